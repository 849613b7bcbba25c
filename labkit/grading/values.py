"""Values as JSON: arrays with type and shape, tuples apart from lists, NaN by name.

JSON alone knows no array, no tuple and no NaN; each is an object with one telling key.
Floats are written with as many digits as bring back the same bits.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labkit.errors import InvalidParameterError
from labkit.grading.contract import Value

DTYPES = ("float64", "int64", "bool")


def to_plain(value: Value) -> Any:
    """What JSON can hold of `value`.

    Raises
    ------
    InvalidParameterError
        For what is no data, and for an array of another type than float64, int64 and bool.

    Examples
    --------
    >>> to_plain((True, np.eye(2)))
    {'tuple': [True, {'dtype': 'float64', 'shape': [2, 2], 'data': [1.0, 0.0, 0.0, 1.0]}]}
    """
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {"float": repr(value)}
    if isinstance(value, tuple):
        return {"tuple": [to_plain(entry) for entry in value]}
    if isinstance(value, dict):
        return {"dict": {key: to_plain(entry) for key, entry in value.items()}}
    if isinstance(value, np.ndarray) and value.dtype.name in DTYPES:
        data = value.ravel().tolist()
        if not np.isfinite(value).all():
            data = [entry if math.isfinite(entry) else repr(entry) for entry in data]
        return {"dtype": value.dtype.name, "shape": list(value.shape), "data": data}
    raise InvalidParameterError(f"must be plain data, got {value!r:.80}", parameter="value")


def from_plain(plain: Any) -> Value:
    """What `to_plain` was given; arrays come back read-only.

    Examples
    --------
    >>> from_plain({"tuple": [1, {"float": "nan"}]})
    (1, nan)
    """
    if not isinstance(plain, dict):
        scalar: Value = plain
        return scalar
    if "tuple" in plain:
        return tuple(from_plain(entry) for entry in plain["tuple"])
    if "dict" in plain:
        return {key: from_plain(entry) for key, entry in plain["dict"].items()}
    if "float" in plain:
        return float(plain["float"])
    array = np.array(plain["data"], dtype=plain["dtype"]).reshape(plain["shape"])
    array.setflags(write=False)
    return array
