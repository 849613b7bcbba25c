"""Ctrl-C while the command ``labkit`` loads: one line and status 130, and no traceback.

What numba loads calls Python back, and an exception there is lost: only a handler ends the process.
"""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
MESSAGE = "\nlabkit: interrupted; no file is left half-written\n"


@contextmanager
def loading() -> Iterator[None]:
    """End the command at once if it is interrupted in this block: nothing is written yet."""
    program = sys.orig_argv[-len(sys.argv) :][:1]  # known while `python -m labkit` loads, too
    names = [os.path.basename(path).removesuffix(".exe") for path in program]
    has_default_handler = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    replaces_handler = names == ["labkit"] and has_default_handler
    if replaces_handler:
        signal.signal(signal.SIGINT, _leave)
    try:
        yield
    finally:
        if replaces_handler:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _leave(*_: object) -> None:
    os.write(2, MESSAGE.encode())
    os._exit(INTERRUPTED)
