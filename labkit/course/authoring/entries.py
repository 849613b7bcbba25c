"""Entry of a question of the assignment: an exercise with points, a text and hidden cases.

The lesson trims in two ways (book, Errata: "Trimming: of which points?"), so the ICP questions have
two right answers each, one a reading; all others have one.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import labkit
from labkit.course.exercises.entries import Arguments, Function, exercise
from labkit.grading.box.inside.data import Value
from labkit.grading.questions import Answer, Question
from labkit.support.arrays import FloatArray


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
    """Arguments on a limit, in numbers that single precision holds; which are not rounded."""

    drawn: Arguments | Draw


Recipe = Arguments | Draw | Exact
Recipes = Mapping[str, Recipe]  # by what the case tries, in words without a number


def recipe(draw: Callable[..., Arguments]) -> Callable[..., Draw]:
    """Decorate a function that draws: with its settings alone it is a recipe for a case."""
    return lambda *args, **kwargs: lambda rng: draw(rng, *args, **kwargs)


@dataclass(eq=False, kw_only=True)
class question(exercise):
    """Enter the decorated function as the right one of a question; `visible` and `hidden` are
    recipes for cases. Its docstring is the stub's, its body the solution."""

    points: float
    answer: Answer
    chapter: str  # that explains it
    task: str
    oracle: Function | Sequence[Function]  # other right functions, of the first readings
    visible: Recipes
    hidden: Mapping[str, Recipe | Recipes]  # in groups by what they try, which give the points
    unit: str = ""
    low: float | None = None
    high: float | None = None
    tolerance: float = 2e-5  # of an entry, relative to the largest of its answer or to 1

    @cached_property
    def asked_for(self) -> Question:
        """The question as the grading knows it."""
        fields = ("answer", "chapter", "unit", "low", "high")
        return self.as_question(
            **{name: getattr(self, name) for name in fields},
            points=float(self.points),
            task=self.task.strip(),
            docstring=inspect.cleandoc(self.right.__doc__ or "") + "\n",
        )

    @property
    def hidden_rows(self) -> Iterator[tuple[str, str, Recipe]]:
        """Group, text and recipe of each hidden case; one without a group is one by itself."""
        for name, value in self.hidden.items():
            if isinstance(value, Mapping):
                yield from ((name, about, drawn) for about, drawn in value.items())
            else:
                yield "", name, value

    @property
    def oracles(self) -> Sequence[Function]:
        """The oracles, those of the first readings."""
        return [self.oracle] if callable(self.oracle) else self.oracle

    @property
    def solution(self) -> str:
        """The source of the solution without its docstring."""
        return f"def {self.right.__name__}{self.asked_for.signature}:\n{self.body}"

    @property
    def body(self) -> str:
        """The lines of the solution."""
        docstring, source = self.right.__doc__ or "", inspect.getsource(self.right)
        return source.partition(f'"""{docstring}"""\n')[2]
