"""Families of mistakes in the arguments: exchanged, squared, in degrees, forgotten.

They hold for every question. Each is told by the right function itself, which is asked with changed
arguments: where a student's answers are these in every case, the sentence is true, whatever the
student's code looks like. Families in the answers are in `labkit.course.grading.judging.relations`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

Changes = dict[str, tuple[str, Callable[[Any], Any]]]  # what is said of each, and what it does


class Family(NamedTuple):
    """One family on the arguments of a question."""

    id: str
    says: str


CHANGES: Changes = {  # of numbers and arrays of numbers
    "from_degrees": ("`{0}` is taken for degrees; it is in radians", np.deg2rad),
    "to_degrees": ("`{0}` is turned into degrees; keep radians", np.rad2deg),
    "negated": ("`{0}` enters with the wrong sign", np.negative),
    "unsigned": ("`{0}` enters without its sign", np.abs),
    "squared": ("`{0}` enters as its square", np.square),
    "rooted": ("`{0}` enters as its square root", lambda x: np.sqrt(np.abs(x))),
    "upside_down": ("`{0}` enters as 1/`{0}`", lambda x: 1.0 / x),
    "doubled": ("`{0}` enters twice as large", lambda x: 2 * x),
    "halved": ("`{0}` enters half as large", lambda x: 0.5 * x),
    "complement": ("1 − `{0}` stands where `{0}` belongs", lambda x: 1 - x),
    "to_millimetres": ("`{0}` is turned into millimetres; keep metres", lambda x: 1000.0 * x),
}
OF_ARRAYS: Changes = {
    "sorted": ("`{0}` is sorted first, so its entries lose their places", lambda x: np.sort(x, 0)),
    "reversed": ("`{0}` is taken from its end", lambda x: x[::-1]),
    "unused": ("`{0}` makes no difference: all of its entries count alike", np.ones_like),
    "zero": ("`{0}` makes no difference: it counts as zero", np.zeros_like),
}
OF_POINTS: Changes = {
    "axes": ("x and y of `{0}` are exchanged", lambda x: x[..., ::-1]),
    "flat": ("y of `{0}` is left out", lambda x: x * (1, 0)),
    "upright": ("x of `{0}` is left out", lambda x: x * (0, 1)),
    "from_centroid": ("`{0}` is centred, although it should not be", lambda x: x - x.mean(0)),
}
OF_MATRICES: Changes = {
    "inverted": ("`{0}` is inverted: the wrong one of two frames?", np.linalg.inv),
    "transposed": ("`{0}` is transposed", np.transpose),
    "identity": ("`{0}` makes no difference: it counts as no motion", lambda x: np.eye(len(x))),
}
OF_LIMITS: Changes = {
    "no_limit": (
        "the condition on `{0}` is forgotten: it counts as if without end",
        lambda x: np.inf,
    ),
    "no_number": ("the condition on `{0}` is forgotten: it counts as zero", lambda x: type(x)(0)),
    "one": ("`{0}` makes no difference: it counts as one", lambda x: type(x)(1)),
}
OF_COUNTS: Changes = {
    "one_more": ("`{0}` is one too large: counted from 0, or from 1?", lambda x: x + 1),
    "one_less": ("`{0}` is one too small: counted from 0, or from 1?", lambda x: x - 1),
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
            yield Family(f"{name}-{id}", sentence(says.format(name))), tuple(changed)


def sentence(says: str) -> str:
    """The sentence of a family, from what it changes."""
    return f"Your answers are those that come out when {says}."


def _form(value: Any) -> tuple[Any, ...] | None:
    """Kind and axes of arguments that can be taken for one another; the rows do not count."""
    if isinstance(value, bool | str) or not isinstance(value, int | float | np.ndarray):
        return None
    array = np.asarray(value)
    return array.dtype.kind, array.ndim, *array.shape[1:]


def _fitting(value: Any) -> Changes:
    """The changes that make sense for a value; none of them leads an index beyond its array."""
    if isinstance(value, tuple):
        return {"reversed": OF_ARRAYS["reversed"]}
    if isinstance(value, bool | str) or not isinstance(value, int | float | np.ndarray):
        return {}
    array = np.asarray(value)
    if array.dtype == bool:
        return {"inverted": ("`{0}` is inverted", np.logical_not)}
    if array.ndim == 0:
        return OF_LIMITS | (OF_COUNTS if isinstance(value, int) else CHANGES)
    if array.ndim == 2 and array.shape[0] == array.shape[1]:
        return OF_MATRICES
    of_values = CHANGES if array.dtype.kind == "f" else {}
    return OF_ARRAYS | of_values | (OF_POINTS if array.shape[-1] == 2 else {})
