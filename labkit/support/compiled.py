"""Compile functions with numba; without numba, run them in Python.

A compiled function works on arrays and numbers, in plain Python: what the book quotes is what
runs. It returns arrays and numbers to Python, no named tuple: numba makes those by running Python,
and an interrupt there ends the process. Python runs the same functions a hundred times slower.

Two things change for the whole process, and only while a first call loads or compiles:

- the garbage collector pauses (`_collector_paused`): a collection comes later, nothing else;
- numba's `ensure_blas` does nothing (`_load_without_blas`): a matrix product that another thread
  compiles meanwhile looks for its BLAS at its first call.
"""

import contextlib
import functools
import gc
import importlib
import logging
import sys
import threading
from collections.abc import Callable, Iterator
from types import FunctionType
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)
NUMBA_OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # 1/0 is inf
INNER_OPTIONS = NUMBA_OPTIONS | {"no_cpython_wrapper": True}
_records: list[type] = []
_entries: list[Any] = []  # of each compiled function: what Python calls
_one_compilation = threading.Lock()


def record(class_: C) -> C:
    """Mark a frozen dataclass whose numbers compiled functions read."""
    _records.append(class_)
    return class_


def compiled(function: F) -> F:
    """Let numba compile a function, and those that it calls, at its first call."""

    @functools.cache
    def entry() -> Any:  # what Python calls
        if (numba := load_numba()) is None:
            return _in_python(function)
        from labkit.support.code_cache import keep  # noqa: PLC0415 (imports numba)

        return keep(numba.njit(**NUMBA_OPTIONS)(function))

    has_returned = False  # a first call: it loads or compiles

    def first_call(*arguments: Any) -> Any:
        nonlocal has_returned
        outcome = entry()(*arguments)
        has_returned = True
        return outcome

    def call(*arguments: Any) -> Any:
        if not has_returned:
            return _call_in_thread(lambda: first_call(*arguments))
        try:
            return entry()(*arguments)
        except SystemError as error:
            raise _first_cause(error) from None

    call.__code__ = call.__code__.replace(co_name=function.__name__)  # as a traceback shows it
    wrapper: Any = functools.wraps(function)(call)
    # The same function as other compiled functions call it.
    wrapper.dispatcher = functools.cache(lambda: load_numba().njit(**INNER_OPTIONS)(function))
    _entries.append(entry)
    return wrapper  # type: ignore[no-any-return]


def _first_cause(error: BaseException) -> BaseException:
    """The error behind a `SystemError`: numba wraps an interrupt while it makes the result."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error


def _call_in_thread(call: Callable[[], Any]) -> Any:
    """Return what `call` returns, or raise what it raises; an interrupt does not reach it.

    numba cannot be interrupted: a compilation that ends halfway spoils the functions for the rest
    of the process. Ctrl-C is raised in the main thread alone. So the caller sees the interrupt at
    once, the compilation goes on behind, and the next call waits for it. A browser has no threads,
    and no numba: there it is a plain call.
    """
    if sys.platform == "emscripten":
        return call()
    outcome: list[Any] = []
    errors: list[BaseException] = []

    def work() -> None:
        with _one_compilation, _collector_paused():
            try:
                outcome.append(call())
            except BaseException as error:  # for the caller
                errors.append(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join()
    if errors:
        raise errors[0]
    return outcome[0]


@contextlib.contextmanager
def _collector_paused() -> Iterator[None]:
    """Pause Python's garbage collector, which would look again and again through what numba loads.

    numba makes many objects, and nearly all of them stay.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def compiled_signatures() -> dict[str, list[Any]]:
    """The argument types for which each function was compiled or loaded, in this process."""
    called = [entry() for entry in _entries if entry.cache_info().currsize]
    in_numba = [function for function in called if hasattr(function, "signatures")]
    return {f"{each.__module__}.{each.__name__}": each.signatures for each in in_numba}


def _in_python(function: Any) -> Any:
    """A copy of a function that runs in Python, and so do the compiled functions that it calls.

    The copy sees other global names: in place of each compiled function a copy like itself.
    """
    names = dict(function.__globals__)
    used = names.keys() & {*function.__code__.co_names}
    for name in used:
        if hasattr(names[name], "dispatcher"):
            names[name] = _in_python(names[name].__wrapped__)
    return FunctionType(function.__code__, names, None, function.__defaults__)


@functools.cache
def load_numba() -> Any:
    """Import numba, and tell it of our functions and records; None, with a warning, without it."""
    try:
        import numba  # noqa: PLC0415 (nobody else waits for it)
        from numba.extending import typeof_impl  # noqa: PLC0415

        _load_without_blas()
    except ImportError as error:
        logging.getLogger("labkit").warning("Python runs the matcher, slowly: %s", error)
        return None
    typeof_impl.register(
        FunctionType,
        lambda value, _: (
            numba.types.Dispatcher(value.dispatcher()) if hasattr(value, "dispatcher") else None
        ),
    )
    if numba.config.DISABLE_JIT:  # a student steps through the functions
        return None
    from labkit.support.records import register  # noqa: PLC0415 (imports numba)

    for class_ in _records:
        register(class_)
    return numba


def _load_without_blas() -> None:
    """Import numba's array functions without `scipy.linalg`, a third of the first match.

    numba loads it only to see that there is a BLAS, which no compiled function here needs. Where
    other code compiles a matrix product, numba looks for the BLAS then.
    """
    linalg: Any = importlib.import_module("numba.np.linalg")
    ensure_blas = linalg.ensure_blas
    linalg.ensure_blas = lambda: None  # "there is one"
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = ensure_blas
