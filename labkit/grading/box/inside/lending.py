"""Right functions in place of a student's, by whatever name the program keeps its own.

A program keeps a function under its name, as a default argument, in a dict, in a partial. So each
function that is asked for goes into a slot as soon as the statement that defines it has run.

Not replaced are what a decorator of that statement keeps of it, as in a table of functions, and a
helper to which it hands its work on. A caller that has its name in a string alone, for `eval` or
``globals()[...]``, is not known to call it, so that no right function is lent to it.
"""

from __future__ import annotations

import contextlib
import copy
import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


class RightFunction:
    """A right function that takes the arguments of a student's, and may answer in its form."""

    def __init__(self, function: Callable[..., Any], *, asks_form: bool = False) -> None:
        self.function = function
        self.count = len(inspect.signature(function).parameters)
        self.asks_form = asks_form  # of the student's function, at the first call
        self.form: Any = None  # an answer of the student's function; None where it has none

    def call(self, own: Any, positional: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Call it with the arguments that the student's function `own` was given."""
        if self.asks_form:
            self.asks_form = False
            with contextlib.suppress(Exception, SystemExit):
                self.form = own(*copy.deepcopy(positional), **copy.deepcopy(named))
        if named or len(positional) != self.count:  # a right function has no defaults and extras
            bound = inspect.signature(own).bind(*positional, **named)
            bound.apply_defaults()
            positional = bound.args[: self.count] or tuple(named.values())
        value = self.function(*map(as_array, positional))
        with contextlib.suppress(Exception):  # the form may be anything
            return value if self.form is None else in_form(value, self.form)
        return value


class Slot:
    """A student's function, but for its calls while a right one stands in its place."""

    __slots__ = ("_lent", "_name", "_own")

    def __init__(self, name: str, own: Any, lent: Mapping[str, RightFunction]) -> None:
        object.__setattr__(self, "_name", name)
        object.__setattr__(self, "_own", own)
        object.__setattr__(self, "_lent", lent)

    def __call__(self, *positional: Any, **named: Any) -> Any:
        """Call the right function, or the student's where there is none."""
        right = self._lent.get(self._name)
        if right is None:
            return self._own(*positional, **named)
        return right.call(self._own, positional, named)

    @property  # type: ignore[misc]
    def __class__(self) -> type:
        return type(self._own)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)

    def __deepcopy__(self, _: Any) -> Any:
        return self  # as any function

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._own, name, value)

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        """The same for a method, bound as the student's is."""
        if not hasattr(self._own, "__get__"):
            return self
        return Slot(self._name, self._own.__get__(instance, owner), self._lent)


def undefined(name: str) -> Callable[..., Any]:
    """A function that the student did not define: its calls raise, and no sooner."""

    def call(*_: Any, **__: Any) -> Any:
        raise NameError(f"name {name!r} is not defined")

    return call


def as_array(value: Any) -> Any:
    """An argument as a right function takes it: a list of numbers becomes an array."""
    return np.array(value) if isinstance(value, list | tuple) else value


def in_form(value: Any, form: Any) -> Any:
    """A right answer in the form of the student's: as nested, and in the same kinds of containers.

    >>> in_form(np.array([True, False]), [0, 1, 1])
    [True, False]
    >>> in_form((np.eye(2), np.ones(2)), {"T": np.eye(3)})["T"][0].tolist()
    [1.0, 0.0, 1.0]
    """
    if isinstance(form, dict):
        R, t = as_pair(value)
        parts = {"R": R, "t": t, "T": as_matrix(value)}
        return form | {name: in_form(parts[name], form[name]) for name in parts if name in form}
    if isinstance(form, list | tuple):
        is_pair = len(form) == 2 and np.shape(form[0]) == (2, 2)
        value = as_pair(value) if is_pair else as_matrix(value)
        entries = value if isinstance(value, tuple) else np.atleast_1d(value)
        first = form[0] if form else None  # an empty one tells nothing
        forms = form if len(form) == len(entries) else [first] * len(entries)
        make = getattr(form, "_make", type(form))  # of a named tuple
        return make([in_form(*pair) for pair in zip(entries, forms, strict=True)])
    array = np.asarray(as_matrix(value))
    if isinstance(form, np.ndarray):
        if array.ndim < form.ndim:
            is_row = form.ndim == 2 and len(form) == 1 < form.size
            array = array.reshape((1, -1) if is_row else (-1, *[1] * (form.ndim - 1)))
        return array.astype(np.result_type(array, form)).view(type(form))
    return array.item() if isinstance(form, bool | int | float) and array.ndim == 0 else value


def as_matrix(value: Any) -> Any:
    """The matrix of a transform (R, t); any other value as it is."""
    if not isinstance(value, tuple) or np.shape(value[0]) != (2, 2):
        return value
    T = np.eye(3)
    T[:2, :2], T[:2, 2] = value
    return T


def as_pair(value: Any) -> Any:
    """The pair (R, t) of a transform in either form."""
    return value if isinstance(value, tuple) else (value[:2, :2], value[:2, 2])
