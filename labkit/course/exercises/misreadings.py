"""Misreadings of an argument: squared, in degrees, counted one too few, exchanged with another.

Where a function is right once its argument is changed, it reads the argument so. Nothing here knows
a mistake, and no answer is needed but the right one to the call as it was.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from labkit.se2 import invert

Value = Any
Misreading = tuple[str, tuple[Value, ...]]  # a phrase, and the arguments that make up for it
Change = tuple[str, Callable[[Any], Value]]  # a phrase with the name, and what becomes of the value

OF_COUNTS: list[Change] = [
    ("`{} + 1` for `{}`", lambda count: count + 1),
    ("`{} - 1` for `{}`", lambda count: count - 1),
]
OF_NUMBERS: list[Change] = [
    ("`{}**2` for `{}`", np.square),
    ("the root of `{}` for `{}`", lambda x: np.sqrt(np.abs(x))),
    ("`-{}` for `{}`", np.negative),
    ("`{}` in degrees", np.degrees),
    ("`np.radians({})` for `{}`", np.radians),
]
OF_TRANSFORMS: list[Change] = [("the inverse of `{}`", invert)]
OF_ROTATIONS: list[Change] = [("`{}.T` for `{}`", np.transpose)]
OF_ROWS: list[Change] = [
    ("x and y of `{}` exchanged", lambda rows: rows[:, [1, 0, *range(2, rows.shape[1])]]),
]


def misreadings_of(names: Sequence[str], arguments: Sequence[Value]) -> Iterator[Misreading]:
    """The calls that make up for a misreading, each with its phrase."""
    places = range(min(len(names), len(arguments)))
    for place in places:
        for phrase, change in changes_of(arguments[place]):
            changed = list(arguments)
            changed[place] = change(arguments[place])
            yield phrase.format(names[place], names[place]), tuple(changed)
    for a, b in itertools.combinations(places, 2):
        if is_alike(arguments[a], arguments[b]):
            changed = list(arguments)
            changed[a], changed[b] = arguments[b], arguments[a]
            yield f"`{names[a]}` and `{names[b]}` exchanged", tuple(changed)


def changes_of(value: Value) -> list[Change]:
    """The changes that a value can have."""
    if isinstance(value, int):
        return [] if isinstance(value, bool) else OF_COUNTS
    if isinstance(value, float):
        return OF_NUMBERS
    if is_transform(value):
        return OF_TRANSFORMS
    is_array = isinstance(value, np.ndarray) and value.dtype.kind == "f"
    is_square = is_array and value.ndim == 2 and len(value) == len(value.T)
    if not is_array or is_square:
        return OF_ROTATIONS if is_array and len(value) == 2 else []
    return OF_ROWS if value.ndim == 2 else OF_NUMBERS[:3]


def is_alike(a: Value, b: Value) -> bool:
    """True for two values that a call can exchange."""
    if not isinstance(a, np.ndarray) or not isinstance(b, np.ndarray):
        return type(a) is type(b)
    return bool(a.dtype == b.dtype and a.shape[1:] == b.shape[1:])


def is_transform(value: Value) -> bool:
    """True for a (3, 3) transform of the plane."""
    is_matrix = isinstance(value, np.ndarray) and value.shape == (3, 3)
    return is_matrix and np.array_equal(value[2], (0.0, 0.0, 1.0))
