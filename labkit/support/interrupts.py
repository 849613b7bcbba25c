"""Ctrl-C while the command ``labkit`` loads: one line and status 130, and no traceback.

What numba loads calls Python back, and an exception there is lost: only a handler ends the process.
"""

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
LINE = "\nlabkit: interrupted; no file is left half-written\n"


@contextmanager
def loading() -> Iterator[None]:
    """End the command at once if it is interrupted in this block: nothing is written yet."""
    before = signal.getsignal(signal.SIGINT)
    if not is_command() or before is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def is_command() -> bool:
    """Recognise ``labkit …`` and ``python -m labkit …``, where Python still loads the package."""
    started = sys.orig_argv[-len(sys.argv) :][:1]
    return [os.path.basename(each).removesuffix(".exe") for each in started] == ["labkit"]


def _leave(number: int, frame: FrameType | None) -> None:
    os.write(2, LINE.encode())
    os._exit(INTERRUPTED)
