"""Calling of a student's function, in the grader's box and in `check`: in time, come what may.

An outcome is plain data: a value, or how the call ended. `judge.verdict.read_outcome` reads it.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from types import FrameType
from typing import Any

from labkit.grading.box.inside import data


class OutOfTime(BaseException):
    """The time is over; no exception that a student's `except Exception` holds up."""


@contextlib.contextmanager
def limit_time(
    seconds: float,
    *,
    again: float = 0.1,
    is_patient: Callable[[FrameType | None], bool] = lambda _: False,
) -> Iterator[None]:
    """Raise `OutOfTime` where the block takes too much processor time, `again` until it ends.

    A timer of the system counts it, so a busy machine stops nothing. It interrupts between two
    steps of Python code; a call into C ends first, and so does a frame that `is_patient`. Windows
    has no such timer, nor has another thread than the main one.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not hasattr(signal, "setitimer") or not is_main:
        yield
        return
    is_armed = True

    def interrupt(_: int, frame: FrameType | None) -> None:
        if is_armed and not is_patient(frame):
            raise OutOfTime("it took too long, and was cut short")

    before = signal.signal(signal.SIGPROF, interrupt)
    try:
        signal.setitimer(signal.ITIMER_PROF, seconds, again)
        yield
    finally:
        is_armed = False
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def call_function(
    function: Callable[..., Any],
    arguments: Sequence[Any],
    find_place: Callable[[BaseException], str],
    caught: type[BaseException] | tuple[type[BaseException], ...] = BaseException,
) -> dict[str, Any]:
    """Call a function once; the outcome as JSON has it. `OutOfTime` alone goes on."""
    try:
        return {"value": data.to_json(function(*arguments))}
    except OutOfTime:
        raise
    except data.NoAnswerError as error:
        return {"status": "no answer", "message": str(error)}
    except caught as error:
        return {
            "status": "not written" if isinstance(error, NotImplementedError) else "raised",
            "error": type(error).__name__[:60],
            "message": data.describe_error(error) + find_place(error),
            "unwritten": data.find_stub(error)[:60],
        }
