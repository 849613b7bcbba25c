"""What a student's function returned, as plain data, or why it is none.

Runs in the box, on objects that may lie about themselves: exact types are taken by their
own methods' results only as bytes, and the grader rebuilds every value from those.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from labkit.grading.box.standins import StandIn

MAX_NODES = 50_000
MAX_DEPTH = 12
MAX_TEXT = 10_000
SEQUENCES = (tuple, list, range)


class NotDataError(TypeError):
    """A value that is no data; the message says what it is and what to return instead."""


class TooMuchError(ValueError):
    """A value beyond what one question may return."""


def plain(value: Any, most: int) -> Any:
    """Turn a returned value into what `labkit.grading.box.wire` can send.

    Numbers of any kind become float, int or bool; arrays float64, int64 or bool; lists
    and named tuples become tuples.

    Parameters
    ----------
    value : object
        What the student's function returned.
    most : int
        How many bytes of arrays and text it may hold.

    Raises
    ------
    NotDataError
        If it is, or holds, anything but numbers, strings, None, arrays, tuples and dicts.
    TooMuchError
        If it is larger than `most`, or too deeply nested.

    Examples
    --------
    >>> plain([np.float32(0.5), np.int8(3)], most=1000)
    (0.5, 3)
    """
    return _Plain(most).of(value, 0)


class _Plain:
    def __init__(self, most: int) -> None:
        self.left = most
        self.nodes = 0

    def spend(self, count: int) -> None:
        self.left -= count
        self.nodes += 1
        if self.left < 0 or self.nodes > MAX_NODES:
            raise TooMuchError("returned more data than an answer to this question can need")

    def of(self, value: Any, depth: int) -> Any:
        self.spend(8)
        if depth > MAX_DEPTH:
            raise TooMuchError(f"returned data nested deeper than {MAX_DEPTH} levels")
        if isinstance(value, np.ndarray):
            return self.array(value)
        if isinstance(value, SEQUENCES):
            self.spend(8 * len(value))
            return tuple([self.of(item, depth + 1) for item in value])
        if isinstance(value, dict):
            return {self.key(key): self.of(item, depth + 1) for key, item in value.items()}
        return self.single(value)

    def single(self, value: Any) -> Any:
        if value is None:
            return None
        conversions: tuple[tuple[Any, Callable[[Any], Any]], ...] = (
            ((bool, np.bool_), bool),
            ((int, np.integer), self.integer),
            ((float, np.floating), float),
            (str, self.text),
        )
        for kinds, convert in conversions:
            if isinstance(value, kinds):
                return convert(value)
        raise NotDataError(f"returned {described(value)}; return numbers, arrays or tuples")

    def text(self, value: str) -> str:
        if len(value) > MAX_TEXT:
            raise TooMuchError(f"returned a text of {len(value)} characters")
        self.spend(len(value))
        return str(value)

    def integer(self, value: Any) -> int:
        number = int(value)
        if not -(1 << 63) <= number < 1 << 63:
            raise TooMuchError("returned an integer of more than 64 bits")
        return number

    def key(self, key: Any) -> str:
        if not isinstance(key, str):
            raise NotDataError(
                f"returned a dict with {described(key)} as a key; its keys must be strings"
            )
        self.spend(len(key))
        return str(key)

    def array(self, value: Any) -> Any:
        array = np.asarray(value)
        self.spend(int(array.size) * 8)
        if array.ndim > 8:
            raise NotDataError(f"returned an array of {array.ndim} dimensions")
        if array.dtype.kind in "fiub":
            if array.dtype.kind == "u" and array.size and int(array.max()) >= 1 << 63:
                raise TooMuchError("returned an integer of more than 64 bits")
            kind = {"f": "<f8", "i": "<i8", "u": "<i8", "b": "|b1"}[array.dtype.kind]
            with np.errstate(all="ignore"):
                return np.array(array, dtype=kind, order="C")
        if array.dtype.kind == "c":
            raise NotDataError("returned complex numbers; return real ones (`.real`?)")
        raise NotDataError(
            f"returned an array of dtype {array.dtype}, which holds no numbers; "
            f"are its rows of different length?"
        )


def described(value: Any) -> str:
    """What a value is, with its article: "a generator", "an Ellipsis".

    Examples
    --------
    >>> described(iter(()))
    'a tuple_iterator'
    """
    if isinstance(value, StandIn):
        return f"what stands in for {value.__name__}, which does not exist while grading"
    if callable(value) and not isinstance(value, type):
        return "a function, uncalled (are its brackets missing?)"
    name = str(type(value).__name__)[:60]
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
