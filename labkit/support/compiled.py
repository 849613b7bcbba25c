"""Compile with numba; without numba, run in Python.

A stage is a function on arrays and numbers, in plain Python: what the book quotes is what runs.
It returns arrays and numbers to Python, no named tuple: numba makes those by running Python,
and an interrupt there ends the process. Python runs the same functions a hundred times slower.
"""

import functools
import logging
from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # 1/0 is inf
INNER = OPTIONS | {"no_cpython_wrapper": True}


def compiled(function: F, check: Callable[..., tuple[Any, ...]] | None = None) -> F:
    """Mark a stage: numba compiles it, with the stages that it calls, at its first call.

    `check` returns its arguments, or refuses them, where no other stage calls it.
    """

    @functools.cache
    def entry() -> Any:
        if (numba := load_numba()) is None:
            return _in_python(function)
        from labkit.support.code_cache import keep  # noqa: PLC0415 (imports numba)

        return keep(numba.njit(**OPTIONS)(function))

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

    call.__code__ = call.__code__.replace(co_name=function.__name__)  # as a traceback shows it
    stage: Any = functools.wraps(function)(call)
    stage.inner = functools.cache(lambda: load_numba().njit(**INNER)(function))  # in other stages
    return stage  # type: ignore[no-any-return]


def _in_python(function: Any) -> Any:
    """The same function; the stages that it calls check nothing."""
    names = dict(function.__globals__)
    for name in names.keys() & {*function.__code__.co_names}:
        if hasattr(names[name], "__wrapped__"):  # a stage
            names[name] = _in_python(names[name].__wrapped__)
    return FunctionType(function.__code__, names, None, function.__defaults__)


@functools.cache
def load_numba() -> Any:
    """Import numba and show it what a stage is; None, said in one line, where it cannot be had."""
    try:
        import numba  # noqa: PLC0415 (nobody else waits for it)
        from numba.extending import typeof_impl  # noqa: PLC0415
    except ImportError as error:
        logging.getLogger("labkit").warning("Python runs the matcher, slowly: %s", error)
        return None
    dispatcher = numba.types.Dispatcher
    typeof_impl.register(
        FunctionType, lambda one, _: dispatcher(one.inner()) if hasattr(one, "inner") else None
    )
    return None if numba.config.DISABLE_JIT else numba  # a student steps through the stages
