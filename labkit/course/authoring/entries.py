"""Entries of an author for a question: what it is tried on, and the mistakes that are known.

A mistake is a function, or the `solution` with some of its text replaced. The lesson trims in two
ways (book, Errata: "Trimming: of which points?"), so the ICP questions have two right answers each,
one a reading; all others have one. The solution takes ρ of all source points; here it takes ρ of
what the gate left, too. Both run on until nothing moves any more.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Concatenate, NamedTuple, ParamSpec

import numpy as np

import labkit
from labkit.course.authoring import solution
from labkit.course.grading.inside.data import Value
from labkit.support.arrays import FloatArray

Arguments = tuple[Value, ...]
Function = Callable[..., Any]
Edits = Mapping[str, str]
Settings = ParamSpec("Settings")

SOURCE = inspect.getsource(solution)
KEPT = "    kept = distance_gate(d, max_distance) & overlap(d, overlap_ratio)\n"
KEPT_OF_GATED = """\
    kept = distance_gate(d, max_distance)
    kept[kept] = overlap(d[kept], overlap_ratio)
"""
ENOUGH = """\
    if np.count_nonzero(kept) < 2:
        raise ValueError("fewer than two pairs are left")
"""
IN_TWO_READINGS = ("icp_step", "icp")


class Rng(np.random.Generator):
    """A generator of what cases are made of."""

    def number(self, low: float, high: float) -> float:
        """A number with three digits, so that a case can be read."""
        return round(float(self.uniform(low, high)), 3)

    def points(self, count: int, span: float = 4.0) -> FloatArray:
        """Points in a square about the origin, to the centimetre."""
        return np.round(self.uniform(-span, span, (count, 2)), 2)

    def whole_points(self, count: int) -> Value:
        """Distinct points with whole coordinates, as integers."""
        cells = self.choice(21 * 21, size=count, replace=False)
        return np.column_stack([cells // 21 - 10, cells % 21 - 10]).astype(np.int64)

    def motion(self, turn: tuple[float, float], reach: float = 1.0) -> FloatArray:
        """A transform by an angle in `turn` [rad] and up to `reach` [m] along each axis."""
        x, y = self.number(-reach, reach), self.number(-reach, reach)
        return labkit.transform(x, y, self.number(*turn))


Draw = Callable[[Rng], Arguments]


@dataclass(frozen=True)
class Exact:
    """Arguments on a limit, in numbers that single precision holds; they are not perturbed."""

    drawn: Arguments | Draw


Recipe = Arguments | Draw | Exact
Recipes = Mapping[str, Recipe]  # by what the case tries, in words without a number


def recipe(draw: Callable[Concatenate[Rng, Settings], Arguments]) -> Callable[Settings, Draw]:
    """Decorate a function that draws: with its settings alone it is a recipe for a case."""

    def settled(*args: Settings.args, **kwargs: Settings.kwargs) -> Draw:
        return lambda rng: draw(rng, *args, **kwargs)

    return settled


@dataclass(frozen=True)
class Mistake:
    """A known mistake of a question."""

    question: str
    id: str
    credit: float  # the share of the question's points that it earns
    says: str  # to the student
    wrong: Function | Edits | Sequence[Edits]  # several where it can come out in several ways
    chapter: str = ""  # that explains it; empty for the question's own

    @property
    def ways(self) -> list[Function]:
        """The wrong functions, one for each way in which the mistake can come out."""
        if callable(self.wrong):
            return [self.wrong]
        several = [self.wrong] if isinstance(self.wrong, Mapping) else self.wrong
        return [way for edits in several for way in edited(self.question, edits)]


class Entry(NamedTuple):
    """Cases of a question, the same visible ones for everybody, and its known mistakes."""

    visible: Recipes
    hidden: Recipes  # of which each variant draws its own
    mistakes: list[Mistake]


ENTRIES: dict[str, Entry] = {}


def question(
    id: str, *, visible: Recipes, hidden: Recipes, mistakes: Mapping[str, tuple[Any, ...]]
) -> None:
    """Enter the cases and mistakes of a question; a mistake by its id, as `Mistake` takes it."""
    known = [Mistake(id, name, *row) for name, row in mistakes.items()]
    ENTRIES[id] = Entry(visible, hidden, known)


def readings(question: str) -> list[Function]:
    """The right functions of a question, one for each reading."""
    return edited(question, {})


def edited(question: str, edits: Edits) -> list[Function]:
    """The function of a question with each text of `edits` replaced by another, wherever it stands
    in the solution; one for each reading in which all of the texts stand."""
    unknown = [text for text in edits if text not in SOURCE]
    assert not unknown, f"the solution holds no {unknown}, which a mistake of {question} replaces"
    found = []
    for kept in (KEPT, KEPT_OF_GATED)[: 1 + (question in IN_TWO_READINGS)]:
        source = SOURCE.replace(KEPT, kept + ENOUGH)
        if all(text in source for text in edits):
            for text, wrong in edits.items():
                source = source.replace(text, wrong)
            found.append(_names(source.replace("1e-7", "1e-13"))[question])
    return found


@cache
def _names(source: str) -> dict[str, Any]:
    """The names that a submission defines."""
    names: dict[str, Any] = {}
    exec(source, names)
    return names
