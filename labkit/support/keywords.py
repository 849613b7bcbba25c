"""Misspelt keywords: the error names the keyword that was meant."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Collection, Iterable
from typing import Any, TypeVar

from labkit.support.errors import InvalidParameterError

C = TypeVar("C", bound=type)


def check_keywords(given: Iterable[str], known: Collection[str], owner: str) -> None:
    """Raise `InvalidParameterError` for a keyword that `owner`, a class or a function, lacks."""
    for name in given:
        if name not in known:
            (nearest,) = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
            raise InvalidParameterError(
                f"is no keyword of {owner}: did you mean `{nearest}`? It takes {', '.join(known)}",
                parameter=name,
            )


def guard_keywords(class_: C) -> C:
    """Let a class refuse keywords that it lacks by a `LabkitError`, not by Python's TypeError."""
    initialise = class_.__init__  # type: ignore[misc]
    known = list(inspect.signature(class_).parameters)

    @functools.wraps(initialise)
    def check_and_initialise(self: Any, *arguments: Any, **keywords: Any) -> None:
        check_keywords(keywords, known, class_.__name__)
        initialise(self, *arguments, **keywords)

    class_.__init__ = check_and_initialise  # type: ignore[misc]
    return class_
