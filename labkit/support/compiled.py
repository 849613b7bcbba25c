"""One decorator: numba compiles a stage as it stands; where numba is not, Python runs it.

A stage is a function on arrays and numbers, in plain Python: what the book quotes is what runs.
Its machine code is kept on disk (`labkit.support.code_cache`). Without numba, or with one that
does not know this numpy yet, Python runs the same functions, some hundred times slower.

Importing this module does not import numba.
"""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS = {"nogil": True, "error_model": "numpy"}  # threads share the cores; 1/0 is inf
INNER = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def compiled(function: F) -> F:
    """Mark a stage: numba compiles it, with the stages that it calls, at its first call."""
    return functools.wraps(function)(_Stage(function))  # type: ignore[return-value]


class _Stage:
    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function

    def __call__(self, *arguments: Any) -> Any:
        return self.entry(*arguments)

    @functools.cached_property
    def entry(self) -> Callable[..., Any]:
        """The function that Python calls: compiled and kept on disk, or else as it stands."""
        numba = load_numba()
        if numba is None:
            return self.function
        from labkit.support.code_cache import keep  # noqa: PLC0415 (imports numba)

        kept: Callable[..., Any] = keep(numba.njit(**OPTIONS)(self.function))
        return kept

    @functools.cached_property
    def inner(self) -> Any:
        """The function that compiled stages call, as a part of their code."""
        return load_numba().njit(**INNER)(self.function)


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
    typeof_impl.register(_Stage, lambda stage, _: numba.types.Dispatcher(stage.inner))
    return numba
