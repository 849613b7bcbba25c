"""Ctrl-C while the command ``labkit`` loads: one line and status 130, and no traceback.

What numba loads calls Python back, and an exception there is lost: only a handler ends the process.
"""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
LINE = "\nlabkit: interrupted; no file is left half-written\n"


@contextmanager
def loading() -> Iterator[None]:
    """End the command at once if it is interrupted in this block: nothing is written yet."""
    started = sys.orig_argv[-len(sys.argv) :][:1]  # tells it while `python -m labkit` loads, too
    is_command = [os.path.basename(each).removesuffix(".exe") for each in started] == ["labkit"]
    ours = is_command and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, _leave)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _leave(*_: object) -> None:
    os.write(2, LINE.encode())
    os._exit(INTERRUPTED)
