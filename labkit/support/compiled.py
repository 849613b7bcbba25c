"""Compile with numba; without numba, run in Python.

A stage is a function on arrays and numbers, in plain Python: what the book quotes is what runs.
It returns arrays and numbers to Python, no named tuple: numba makes those by running Python,
and an interrupt there ends the process. Without numba, or with one that does not know this
numpy yet, Python runs the same functions, some hundred times slower.
"""

import functools
import logging
import threading
from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
OPTIONS = {"nogil": True, "error_model": "numpy"}  # threads share the cores; 1/0 is inf
INSIDE = threading.local()  # without numba: whether a stage runs, whose calls are not checked
INNER = OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def checked(check: Callable[..., tuple[Any, ...]]) -> Callable[[F], F]:
    """Mark a stage whose arguments `check` returns, or refuses, where Python calls it."""
    return lambda function: compiled(function, check)


def compiled(function: F, check: Callable[..., Any] | None = None) -> F:
    """Mark a stage: numba compiles it, with the stages that it calls, at its first call."""
    inside = INSIDE  # `call` has the globals of its stage

    @functools.cache
    def entry() -> Any:
        if (numba := load_numba()) is None:
            return _in_python(function)
        from labkit.support.code_cache import keep  # noqa: PLC0415 (imports numba)

        return keep(numba.njit(**OPTIONS)(function))

    def call(*arguments: Any, **named: Any) -> Any:
        if check is not None and not getattr(inside, "stage", False):
            arguments, named = check(*arguments, **named), {}
        try:
            return entry()(*arguments, **named)
        except SystemError as error:  # an interrupt, met while numba made the result
            first: BaseException = error
            while first.__cause__ is not None:
                first = first.__cause__
            raise first from None

    code = call.__code__.replace(co_name=function.__name__)  # for tracebacks, as its module
    stage: Any = FunctionType(code, function.__globals__, None, None, call.__closure__)
    stage.inner = functools.cache(lambda: load_numba().njit(**INNER)(function))  # in other stages
    functools.update_wrapper(stage, function)
    return stage  # type: ignore[no-any-return]


def _in_python(function: Callable[..., Any]) -> Callable[..., Any]:
    def run(*arguments: Any, **named: Any) -> Any:
        before, INSIDE.stage = getattr(INSIDE, "stage", False), True
        try:
            return function(*arguments, **named)
        finally:
            INSIDE.stage = before

    return run


@functools.cache
def load_numba() -> Any:
    """Import numba and show it what a stage is; None, said in one line, where it cannot be had."""
    try:
        import numba  # noqa: PLC0415 (nobody else waits for it)
        from numba.extending import typeof_impl  # noqa: PLC0415
    except ImportError as error:
        logging.getLogger("labkit").warning("Python runs the matcher, slowly: %s", error)
        return None
    if numba.config.DISABLE_JIT:  # a student steps through the stages
        return None
    dispatcher = numba.types.Dispatcher
    typeof_impl.register(
        FunctionType, lambda one, _: dispatcher(one.inner()) if hasattr(one, "inner") else None
    )
    return numba
