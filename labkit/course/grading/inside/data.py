"""Plain data: what a student's function returned made into it, and its form in JSON.

`plain` runs in the box, on objects that may lie about themselves. `to_json` and `from_json` are
the only encoding that crosses the wall, and the one of the assignment's files: there is nothing
in it to execute, and `from_json` refuses what `to_json` cannot have written.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

MAX_NODES = 50_000
MAX_NESTING = 12
MAX_TEXT = 10_000
MAX_INTEGER = 1 << 63
DTYPES = ("float64", "int64", "bool")
NOT_FINITE = ("nan", "inf", "-inf")


class NotDataError(TypeError):
    """A value that is no data; the message says what it is and what to return instead."""


class TooMuchError(ValueError):
    """A value beyond what one answer may return."""


def plain(value: Any, most: int) -> Any:
    """Turn a returned value into numbers, text, arrays, tuples and dicts.

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
        if depth > MAX_NESTING:
            raise TooMuchError(f"returned data nested deeper than {MAX_NESTING} levels")
        if isinstance(value, np.ndarray):
            return self.array(value)
        if isinstance(value, tuple | list | range):
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
        if not -MAX_INTEGER <= number < MAX_INTEGER:
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
            if array.dtype.kind == "u" and array.size and int(array.max()) >= MAX_INTEGER:
                raise TooMuchError("returned an integer of more than 64 bits")
            kind = {"f": "float64", "i": "int64", "u": "int64", "b": "bool"}[array.dtype.kind]
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
    if getattr(type(value), "is_stand_in", False):
        return "what stands in for a package that does not exist while grading"
    if callable(value) and not isinstance(value, type):
        return "a function, uncalled (are its brackets missing?)"
    name = str(type(value).__name__)[:60]
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"


def to_json(value: Any) -> Any:
    """What JSON can hold of plain data.

    Raises
    ------
    TypeError
        For what is no plain data, and for an array of another type than float64, int64 and bool.

    Examples
    --------
    >>> to_json((True, np.eye(2)))
    {'tuple': [True, {'dtype': 'float64', 'shape': [2, 2], 'data': [1.0, 0.0, 0.0, 1.0]}]}
    """
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {"float": repr(value)}
    if isinstance(value, tuple):
        return {"tuple": [to_json(entry) for entry in value]}
    if isinstance(value, dict):
        return {"dict": {key: to_json(entry) for key, entry in value.items()}}
    if isinstance(value, np.ndarray) and value.dtype.name in DTYPES:
        data = value.ravel().tolist()
        if not np.isfinite(value).all():
            data = [entry if math.isfinite(entry) else repr(entry) for entry in data]
        return {"dtype": value.dtype.name, "shape": list(value.shape), "data": data}
    raise TypeError(f"must be plain data, got {value!r:.80}")


def from_json(tree: Any, depth: int = 0) -> Any:
    """What `to_json` was given.

    Raises
    ------
    ValueError
        For what `to_json` cannot have written.

    Examples
    --------
    >>> from_json({"tuple": [1, {"float": "nan"}]})
    (1, nan)
    """
    if depth > MAX_NESTING + 2:
        raise ValueError("it is nested too deeply")
    if isinstance(tree, str):  # a lone surrogate would break whoever writes it to a file
        return tree if tree.isascii() else tree.encode("utf-8", "replace").decode()
    if isinstance(tree, int) and not -MAX_INTEGER <= tree < MAX_INTEGER:
        raise ValueError("an integer needs more than 64 bits")
    if tree is None or isinstance(tree, bool | int | float):
        return tree
    if not isinstance(tree, dict):
        raise ValueError("it holds a bare list")
    if isinstance(entries := tree.get("tuple"), list):
        return tuple([from_json(entry, depth + 1) for entry in entries])
    if isinstance(entries := tree.get("dict"), dict):
        return {from_json(key): from_json(entry, depth + 1) for key, entry in entries.items()}
    if tree.get("float") in NOT_FINITE:
        return float(tree["float"])
    return _array(tree.get("dtype"), tree.get("shape"), tree.get("data"))


def _array(dtype: Any, shape: Any, data: Any) -> Any:
    sizes = isinstance(shape, list) and all(type(size) is int and size >= 0 for size in shape)
    if dtype not in DTYPES or not sizes or not isinstance(data, list):
        raise ValueError("an entry is of no known kind")
    if not all(type(entry) in (int, float, bool) or entry in NOT_FINITE for entry in data):
        raise ValueError("an array holds something else than numbers")
    try:
        return np.array(data, dtype=dtype).reshape(shape)
    except (ValueError, OverflowError, MemoryError) as error:
        raise ValueError(f"an array of no possible shape or size: {error}") from None
