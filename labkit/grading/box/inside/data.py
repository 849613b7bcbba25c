"""Plain data and its form in JSON, which alone crosses the wall, and stands in the assignment.

`to_json` runs in the box, on objects that may lie about themselves. Nothing that it writes can be
executed, and `from_json` refuses what it cannot have written.
"""

from __future__ import annotations

import contextlib
import math
import traceback
import types
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from labkit.grading.box.inside.limits import MAX_BYTES, MAX_MESSAGE, MAX_NESTING, NODE_BYTES

Value: TypeAlias = NDArray[Any] | float | str | tuple["Value", ...] | dict[str, "Value"] | None
"""Plain data. Arrays are float64, int64 or bool; a student's list arrives as a tuple."""
DTYPES = {"f": "float64", "i": "int64", "u": "int64", "b": "bool"}


class NoAnswerError(Exception):
    """A returned value that is no answer; the message says what to return instead."""


def plain(value: Any) -> Any:
    """Turn a returned value into numbers, text, arrays, tuples and dicts, as `to_json` does."""
    return from_json(to_json(value))


def to_json(value: Any) -> Any:
    """The form in JSON of a value of at most `MAX_BYTES` bytes.

    Numbers become float, int or bool; arrays float64, int64 or bool; lists become tuples. Raises
    `NoAnswerError` for other values, and for what is larger or too deeply nested.

    >>> to_json((True, np.eye(2)))
    {'tuple': [True, {'dtype': 'float64', 'shape': [2, 2], 'data': [1.0, 0.0, 0.0, 1.0]}]}
    """
    bytes_left = MAX_BYTES

    def encode(value: Any, depth: int) -> Any:
        nonlocal bytes_left
        is_known = isinstance(value, np.ndarray | np.generic | types.ModuleType)
        if not is_known and hasattr(type(value), "__array__"):  # a Series, a tensor
            value = np.asarray(value)
        is_sized = isinstance(value, Sequence | dict)
        entries = value.size if isinstance(value, np.ndarray) else is_sized and len(value)
        bytes_left -= NODE_BYTES + 8 * entries
        if bytes_left < 0 or depth > MAX_NESTING:
            raise NoAnswerError("returned more data than an answer to this question can need.")
        if isinstance(value, Sequence) and not isinstance(value, str | bytes):
            return {"tuple": [encode(entry, depth + 1) for entry in value]}
        if isinstance(value, dict):
            return {"dict": {str(key): encode(entry, depth + 1) for key, entry in value.items()}}
        return _array(value) if isinstance(value, np.ndarray) else _single(value)

    return encode(value, 0)


def _single(value: Any) -> Any:
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer) and abs(int(value)) < 2**63:
        return int(value)
    if isinstance(value, int | float | np.floating | Fraction | Decimal):
        value = float(value)
        return value if math.isfinite(value) else {"float": repr(value)}
    if getattr(type(value), "is_stand_in", False):
        package = str(value.__name__).partition(".")[0]
        description = f"a placeholder, since {package} is not available while grading"
    elif callable(value) and not isinstance(value, type):
        description = "a function, uncalled (are its brackets missing?)"
    else:
        name = type(value).__name__[:60]
        description = f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
    raise NoAnswerError(f"returned {description}; return numbers, arrays or tuples.")


def _array(value: Any) -> dict[str, Any]:
    array = np.asarray(value)
    if array.dtype.kind == "O":  # of fractions, say
        with contextlib.suppress(TypeError, ValueError):
            array = array.astype(np.float64)
    if array.dtype.kind == "c":
        raise NoAnswerError("returned complex numbers; return real ones (`.real`?).")
    if array.dtype.kind not in DTYPES:
        description = f"an array of dtype {array.dtype}, which holds no numbers"
        raise NoAnswerError(f"returned {description}; are its rows of different length?")
    array = array.astype(DTYPES[array.dtype.kind])
    data = array.ravel().tolist()
    if not np.isfinite(array).all():
        data = [entry if math.isfinite(entry) else repr(entry) for entry in data]
    return {"dtype": array.dtype.name, "shape": list(array.shape), "data": data}


def from_json(tree: Any, depth: int = 0) -> Any:  # noqa: PLR0911 (one for each form)
    """The data that `to_json` was given; `ValueError` for text that it cannot have written.

    >>> from_json({"tuple": [1, {"float": "nan"}]})
    (1, nan)
    """
    match tree:
        case str():  # a lone surrogate would break whoever writes it to a file
            return tree.encode("utf-8", "replace").decode()
        case None | bool() | float():
            return tree
        case int() if abs(tree) < 2**63:
            return tree
        case {"tuple": [*entries]} if depth <= MAX_NESTING:
            return tuple([from_json(entry, depth + 1) for entry in entries])
        case {"dict": dict(entries)} if depth <= MAX_NESTING:
            return {key: from_json(entry, depth + 1) for key, entry in entries.items()}
        case {"float": "nan" | "inf" | "-inf" as number}:
            return float(number)
        case {"dtype": "float64" | "int64" | "bool" as dtype, "shape": shape, "data": [*data]}:
            with contextlib.suppress(TypeError, OverflowError, MemoryError):
                return np.array(data, dtype=dtype).reshape(shape)
    raise ValueError("it is no data, or nested too deeply")


def find_stub(error: BaseException) -> str:
    """The name of the stub that raised an error; "" where no stub did."""
    if type(error) is not NotImplementedError or error.args:
        return ""
    *_, (stub, _) = traceback.walk_tb(error.__traceback__)
    return str(stub.f_code.co_name)


def describe_error(error: BaseException) -> str:
    """The error's name and text; it may raise another one instead of its text."""
    if name := find_stub(error):
        return f"`{name}` is not written yet"
    message = type(error).__name__
    with contextlib.suppress(BaseException):
        message += f": {error}"
    return message[:MAX_MESSAGE]
