"""What an exercise is tried on: cases with the right answer and the wrong ones that are known."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import labkit.course.exercises

Cases = Callable[[], Iterator["Case"]]
MACHINERY = {"check", "exercise"}  # modules here that hold no exercises


@dataclass(frozen=True, eq=False)
class Case:
    """One call of the student's function.

    Attributes
    ----------
    where : str
        What is tried, in words that follow "for": "a turn by 0.7 rad about (2, −1)".
    arguments : tuple
        What the function is called with; it gets a copy.
    right : number, array or tuple of them
        What it should return.
    mistakes : mapping of str to value
        What it returns if it makes a known mistake, by the sentence that is said then.
    tolerance : float
        How far off an entry may be, relative to the largest one of `right` or to 1.
    """

    where: str
    arguments: tuple[Any, ...]
    right: Any
    mistakes: Mapping[str, Any] = field(default_factory=dict)
    tolerance: float = 1e-6


@dataclass(frozen=True)
class Exercise:
    """A function that students write, by its name, and the cases that it is tried on."""

    name: str
    title: str
    cases: Cases


_FOUND: dict[str, Exercise] = {}


def exercise(title: str) -> Callable[[Cases], Cases]:
    """Enter a generator of cases as the check of the function that it is named after."""

    def enter(cases: Cases) -> Cases:
        assert cases.__name__ not in _FOUND, f"{cases.__name__} is checked twice"
        _FOUND[cases.__name__] = Exercise(cases.__name__, title, cases)
        return cases

    return enter


def exercises() -> Mapping[str, Exercise]:
    """All exercises of the book, by the name of their function."""
    for module in pkgutil.iter_modules(labkit.course.exercises.__path__):
        if module.name not in MACHINERY:
            importlib.import_module(f"labkit.course.exercises.{module.name}")
    return _FOUND
