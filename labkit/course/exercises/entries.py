"""Entries: the right function of an exercise, what it is tried on, and its known mistakes.

Chapters and assignment share this registry. The docstring of `labkit.course.exercises` says how an
exercise is written; a question of the assignment has more fields (`labkit.course.authoring`).
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import numpy as np

from labkit.course.exercises.stages import stages_of
from labkit.grading.box.inside.data import Value, plain
from labkit.grading.judge.kinds import read
from labkit.grading.questions import Answer, Case, Misconception, Question

Function = Callable[..., Any]
Edits = Mapping[str, str]  # texts of the right function, and what stands there instead
Arguments = tuple[Any, ...]
ENTRIES: dict[str, exercise] = {}
FAILURES = (ArithmeticError, ValueError, IndexError)


@dataclass(frozen=True)
class Mistake:
    """A known mistake of an exercise."""

    id: str
    says: str  # to the student
    wrong: Function | Edits | Sequence[Edits]  # several where it can come out in several ways
    chapter: str = ""  # that explains it; empty for the exercise's own


@dataclass(eq=False)
class exercise:
    """Enter the decorated function as the right one of the name that students write."""

    title: str
    visible: Mapping[str, Any] | Callable[[], Mapping[str, Any]]  # arguments, by words for them
    mistakes: Mapping[str, Any] = field(default_factory=dict)  # wrong functions by their sentence
    # Of an entry, relative to the largest of its result or to 1; or by the arguments.
    tolerance: float | Callable[..., float] = 1e-6

    readings: Sequence[Edits] = ({},)  # edits for each way in which the question can be read

    def __call__(self, right: Function) -> Function:
        """Enter the function."""
        assert right.__name__ not in ENTRIES, f"{right.__name__} is checked twice"
        ENTRIES[right.__name__], self.right = self, right
        return right

    @cached_property
    def known(self) -> list[Mistake]:
        """The known mistakes: ``{sentence: wrong}``, or ``{id: (sentence, wrong, …)}``."""
        return [
            Mistake(id, *row) if isinstance(row, tuple) else Mistake(id, id, row)
            for id, row in self.mistakes.items()
        ]

    def ways(self, mistake: Mistake) -> list[Function]:
        """The wrong functions, one for each way in which the mistake can come out."""
        if callable(mistake.wrong):
            return [mistake.wrong]
        alternatives = [mistake.wrong] if isinstance(mistake.wrong, Mapping) else mistake.wrong
        return [function for edits in alternatives for function in self.apply_edits(edits)]

    def apply_edits(self, edits: Edits) -> list[Function]:
        """The right functions with each text of `edits` replaced by another.

        It is replaced wherever it stands, in a right function that is called as well. There is one
        for each reading in which all the texts stand.
        """
        sources = [_replace(sources_of(self.right), reading) for reading in self.readings]
        absent = [passage for passage in edits if not any(passage in source for source in sources)]
        name = self.right.__name__
        assert not absent, f"{name} does not hold {absent}, which a mistake replaces"
        changed = [
            _replace(source, edits)
            for source in sources
            if all(passage in source for passage in edits)
        ]
        return [definitions_of(source, self.right)[name] for source in changed]

    def answers_of_mistakes(self, arguments: Arguments) -> dict[str, tuple[Value, ...]]:
        """The answers of all mistakes that do not fail on the arguments."""
        by_mistake = {mistake.id: answers(self.ways(mistake), arguments) for mistake in self.known}
        return {id: values for id, values in by_mistake.items() if values}

    def as_question(self, answer: Answer, **more: Any) -> Question:
        """The question as the judge knows it."""
        name = self.right.__name__
        return Question(
            **{"points": 1.0, **more},
            id=name,
            title=self.title,
            function=name,
            signature=f"({', '.join(inspect.signature(self.right).parameters)})",
            answer=answer,
            misconceptions=tuple(
                Misconception(
                    id=mistake.id,
                    says=mistake.says,
                    chapter=mistake.chapter or more.get("chapter", ""),
                )
                for mistake in self.known
            ),
        )

    @cached_property
    def asked(self) -> tuple[Question, list[Case]]:
        """The question and its cases, computed here."""
        calls = self.visible() if callable(self.visible) else self.visible
        cases = [self._case(about, arguments) for about, arguments in calls.items()]
        return self.as_question(_kind(*cases[0].expected)), cases

    def plainer(self, case: Case) -> dict[str, Case]:
        """The cases of a case's stages, by the words of each, where they have an answer."""
        cases = {}
        for stage in stages_of(self.asked[0], case.arguments):
            if answers([self.right], stage.arguments):
                cases[stage.phrase] = self._case(case.id, stage.arguments)
        return cases

    def _case(self, about: str, arguments: Arguments) -> Case:
        """A call with its right answer, and the answers of all mistakes that do not fail."""
        expected = plain(self.right(*arguments))
        answer = _kind(expected)
        sizes = np.abs(read(answer, expected)) * (answer is not Answer.NUMBERS)
        allowed = self.tolerance(*arguments) if callable(self.tolerance) else self.tolerance
        return Case(
            id=about,
            hidden=False,
            about=f"for {about}",
            arguments=arguments,
            expected=(expected,),
            tolerance=allowed * sizes[np.isfinite(sizes)].max(initial=1.0),
            mistaken=self.answers_of_mistakes(arguments),
        )


def answers(ways: Sequence[Function], arguments: Arguments) -> tuple[Value, ...]:
    """Answers of the functions to the arguments; nothing where one of them fails."""
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return tuple(plain(variant(*arguments)) for variant in ways)
    except FAILURES:
        return ()


def source_of(function: Function) -> str:
    """The source of a function without its decorator."""
    _, head, source = _source(function).partition(f"def {function.__name__}(")
    return head + source


_source = cache(inspect.getsource)


def sources_of(function: Function) -> str:
    """The source of a right function, behind those of all right ones that it calls."""
    functions = dict[str, Function]()
    waiting = [function]
    while waiting:
        caller = waiting.pop()
        functions = {caller.__name__: caller, **functions}
        named = [ENTRIES[name].right for name in caller.__code__.co_names if name in ENTRIES]
        waiting += [f for f in named if caller.__globals__.get(f.__name__) is f]
    return "\n".join(map(source_of, functions.values()))


@cache
def definitions_of(source: str, function: Function) -> dict[str, Any]:
    """The names that a source defines, which sees the same ones as the right function."""
    names = dict(function.__globals__)
    exec(source, names)
    return names


def _replace(source: str, edits: Edits) -> str:
    for passage, replacement in edits.items():
        source = source.replace(passage, replacement)
    return source


def _kind(expected: Any) -> Answer:
    """The kind of answer, by the form of the right one."""
    if isinstance(expected, tuple):
        return Answer.TRANSFORM if np.ndim(expected[0]) == 2 else Answer.NUMBERS
    array = np.asarray(expected)
    if array.dtype == bool:
        return Answer.MASK if array.ndim else Answer.FLAG
    if array.shape == (3, 3):
        is_rigid = np.array_equal(array[2], (0.0, 0.0, 1.0))
        return Answer.TRANSFORM if is_rigid else Answer.MATRIX
    return (Answer.NUMBER, Answer.VECTOR, Answer.POSES)[array.ndim]
