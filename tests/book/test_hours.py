"""The hours that the book tells add up."""

from __future__ import annotations

from pathlib import Path

import hours
import pytest

ROOT = Path(__file__).parents[2]
RATES = {"words_a_minute": 10, "prediction": 2, "question": 3}


def test_the_heads_are_counted_and_the_sums_are_theirs():
    """If not: `python book/_ext/hours.py --write`."""
    assert [path.name for path in hours.stale(ROOT)] == []


@pytest.mark.parametrize(
    ("text", "minutes"),
    [
        ("# One\n" + 99 * "word ", (10, 0, 10)),
        ("# One\n" + 99 * "word " + "\n$$\nx + y\n$$\n", (10, 0, 10)),
        ("# One\n:class: predict\n:class: predict\n:class: predict", (5, 0, 5)),
        ("# One\n## Two\n\n*Deeper.*" + 99 * " word" + "\n### Three" + 99 * " word", (20, 0, 0)),
        ("# One\n## Two\n\n*Deeper.*\n## Three\n" + 99 * "word ", (10, 0, 10)),
        (":::{exercise} A · ★☆☆ · 25 min\nWrite.\n:::\n", (0, 25, 25)),
        (":::{exercise} A · ★☆☆ · 25 min · deeper\nWrite.\n:::\n", (0, 25, 0)),
    ],
)
def test_minutes_are_counted(text, minutes):
    assert hours.count(text, RATES) == hours.Minutes(*minutes)
