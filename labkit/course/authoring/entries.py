"""Entry of a question of the assignment: an exercise with points, a text and hidden cases.

The lesson trims in two ways (book, Errata: "Trimming: of which points?"), so the ICP questions have
two right answers each, one a reading; all others have one.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Concatenate, ParamSpec

import numpy as np

import labkit
from labkit.course.exercises.entries import Arguments, Function, exercise
from labkit.course.grading.assignment.questions import Answer, Question
from labkit.course.grading.inside.data import Value
from labkit.support.arrays import FloatArray

Settings = ParamSpec("Settings")


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


@dataclass(eq=False, kw_only=True)
class question(exercise):
    """Enter the decorated function as the right one of a question; `visible` and `hidden` are
    recipes for cases. Its docstring is the stub's, its body the solution."""

    points: float
    answer: Answer
    chapter: str  # that explains it
    task: str
    oracle: Function | Sequence[Function]  # another right function, one for each reading
    hidden: Recipes  # of which each variant draws its own
    unit: str = ""
    low: float | None = None
    high: float | None = None
    chance: float = 0.0
    slack: Callable[[Arguments], float] = lambda arguments: 0.0  # of the tolerance, on top
    alike: Callable[[Recipe, Arguments], Recipe] | None = None  # as hard as another variant's case

    @cached_property
    def asked_for(self) -> Question:
        """The question as the grading knows it."""
        given = ("answer", "chapter", "unit", "low", "high", "chance")
        return self.posed(
            **{name: getattr(self, name) for name in given},
            points=float(self.points),
            task=self.task.strip(),
            docstring=inspect.cleandoc(self.right.__doc__ or "") + "\n",
        )

    @property
    def solution(self) -> str:
        """The source of the solution without its docstring."""
        return f"def {self.right.__name__}{self.asked_for.signature}:\n{self.body}"

    @property
    def body(self) -> str:
        """The lines of the solution."""
        docstring, source = self.right.__doc__ or "", inspect.getsource(self.right)
        return source.partition(f'"""{docstring}"""\n')[2]
