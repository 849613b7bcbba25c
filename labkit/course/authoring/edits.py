"""Submissions that differ from the solution in some of its text: the other reading, and mistakes.

The lesson trims in two ways (book, Errata: "Trimming: of which points?"), so the ICP questions have
two right answers each, one a reading; all others have one. The solution takes ρ of all source
points; here it takes ρ of what the gate left, too. Both run on until nothing moves any more.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from labkit.course.authoring import solution

Edits = Mapping[str, str]
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


def readings(question: str) -> list[Callable[..., Any]]:
    """The right functions of a question, one for each reading."""
    return edited(question, {})


def edited(question: str, edits: Edits) -> list[Callable[..., Any]]:
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
