"""Families of mistakes in the arguments: exchanged, squared, in degrees, forgotten.

Each is told by the right function itself, which is asked with changed arguments. What is done to
answers as well as to arguments is in `labkit.grading.judge.relations`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from labkit.grading.judge.relations import (
    COUNTS,
    MATRICES,
    NUMBERS,
    ROWS,
    Change,
    sentence,
)

Changes = dict[str, Change]


class Family(NamedTuple):
    """One family on the arguments of a question."""

    id: str
    says: str


ARRAYS: Changes = ROWS | {
    "unused": ("{} makes no difference: all of its entries count alike", np.ones_like),
    "zero": ("{} makes no difference: it counts as zero", np.zeros_like),
}
POINTS: Changes = {
    "axes": ("x and y of {} are exchanged", lambda x: x[..., ::-1]),
    "from_centroid": ("{} is centred, although it should not be", lambda x: x - x.mean(0)),
}
UNMOVED: Changes = {
    "identity": ("{} makes no difference: it counts as no motion", lambda x: np.eye(len(x))),
}
LIMITS: Changes = {
    "no_limit": ("the condition on {} is forgotten: it counts as if without end", lambda x: np.inf),
    "no_number": ("the condition on {} is forgotten: it counts as zero", lambda x: type(x)(0)),
    "one": ("{} makes no difference: it counts as one", lambda x: type(x)(1)),
}


def families(
    names: Sequence[str], arguments: tuple[Any, ...]
) -> Iterator[tuple[Family, tuple[Any, ...]]]:
    """Each family that fits the arguments, with these as it changes them; the likeliest first."""
    for one, other in combinations(range(len(arguments)), 2):
        if _form(arguments[one]) == _form(arguments[other]) is not None:
            changed = list(arguments)
            changed[one], changed[other] = arguments[other], arguments[one]
            says = f"`{names[one]}` and `{names[other]}` are exchanged"
            yield Family(f"{names[one]}-{names[other]}-exchanged", sentence(says)), tuple(changed)
    for place, (name, value) in enumerate(zip(names, arguments, strict=True)):
        for id, (says, change) in _fitting(value).items():
            try:
                with np.errstate(all="ignore"):
                    changed = [*arguments[:place], change(value), *arguments[place + 1 :]]
            except (ValueError, TypeError, ArithmeticError):
                continue
            yield Family(f"{name}-{id}", sentence(says, f"`{name}`")), tuple(changed)


def _form(value: Any) -> tuple[Any, ...] | None:
    """Kind and axes of arguments that can be taken for one another; the rows do not count."""
    if isinstance(value, bool | str) or not isinstance(value, int | float | np.ndarray):
        return None
    array = np.asarray(value)
    return array.dtype.kind, array.ndim, *array.shape[1:]


def _fitting(value: Any) -> Changes:
    """The changes that make sense for a value; none of them leads an index beyond its array."""
    if isinstance(value, tuple):
        return {"reversed": ROWS["reversed"]}
    if isinstance(value, bool | str) or not isinstance(value, int | float | np.ndarray):
        return {}
    array = np.asarray(value)
    if array.dtype == bool:
        return {"inverted": ("{} is inverted", np.logical_not)}
    if array.ndim == 0:
        return LIMITS | (COUNTS if isinstance(value, int) else NUMBERS)
    if array.ndim == 2 and array.shape[0] == array.shape[1]:
        return MATRICES | UNMOVED
    of_values = NUMBERS if array.dtype.kind == "f" else {}
    return ARRAYS | of_values | (POINTS if array.shape[-1] == 2 else {})
