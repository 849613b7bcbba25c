"""Compile with numba; without numba, run in Python.

A stage is a function on arrays and numbers, in plain Python: what the book quotes is what runs.
What it returns to Python is a tuple of arrays and numbers, never a named one: numba makes those
by running Python, which an interrupt would end. Machine code is kept on disk
(`labkit.support.code_cache`). Without numba, or with one that does not know this numpy yet,
Python runs the same functions, some hundred times slower.

Importing this module does not import numba.
"""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar, overload

F = TypeVar("F", bound=Callable[..., Any])
Check = Callable[..., tuple[Any, ...]]

OPTIONS = {"nogil": True, "error_model": "numpy"}  # threads share the cores; 1/0 is inf


@overload
def compiled(function: F) -> F: ...
@overload
def compiled(*, check: Check) -> Callable[[F], F]: ...
def compiled(function: F | None = None, *, check: Check | None = None) -> Any:
    """Mark a stage: numba compiles it, with the stages that it calls, at its first call.

    What Python gives it passes through `check`, which returns the arguments or raises. What
    another stage gives it does not.
    """
    if function is None:
        return functools.partial(compiled, check=check)

    @functools.cache
    def inner() -> Any:
        return load_numba().njit(**OPTIONS)(function)

    @functools.cache
    def entry() -> Any:
        if load_numba() is None:
            return function
        from labkit.support.code_cache import keep  # noqa: PLC0415 (imports numba)

        return keep(load_numba().njit(**OPTIONS)(function))

    def call(*arguments: Any, **named: Any) -> Any:
        if check is not None:
            arguments, named = check(*arguments, **named), {}
        try:
            return entry()(*arguments, **named)
        except SystemError as error:  # an interrupt, met while numba made the result
            first: BaseException = error
            while first.__cause__ is not None:
                first = first.__cause__
            raise first from None

    # Under its own name and module, for doctest and tracebacks.
    code = call.__code__.replace(co_name=function.__name__)
    stage: Any = FunctionType(code, function.__globals__, None, None, call.__closure__)
    stage.inner = inner
    return functools.wraps(function)(stage)


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

    def stage_type(function: Any, _: object) -> Any:
        return numba.types.Dispatcher(function.inner()) if hasattr(function, "inner") else None

    typeof_impl.register(FunctionType, stage_type)
    return numba
