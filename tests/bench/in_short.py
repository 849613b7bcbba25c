"""The top of the benchmark's page: labkit's point-to-line beside the best of its peers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from tables import markdown, number

LINE = "labkit point-to-line"
POINT = "labkit point-to-point"
POINT_PEERS = ("small_gicp ICP", "Open3D point-to-point", "MRPT ICP")  # all pairs count alike
LESSON = "the lesson's listing"
NO_PEERS = ("labkit", LESSON)
ERRORS = {  # a column of the short table each
    "mm": ("translation_mm", "median", ".2f"),
    "mm, p95": ("translation_mm", "p95", ".2f"),
    "deg": ("rotation_deg", "median", ".3f"),
    "deg, p95": ("rotation_deg", "p95", ".3f"),
}
SLACK = 1.05  # an error is no worse than another if it is at most so many times as large

SHORT = """\
## In short

These tables compare `labkit`'s point-to-line with the best of its peers: those that were quick
enough to be tried on every pair. Times are medians, in milliseconds per pair. The number after a
colon is the ratio to `labkit`'s time. A peer is exact if it fails no more often than `labkit` and
none of its four errors is more than twice as large; a dash stands where no peer is. The number in
parentheses after each error is the smallest error of any peer. A ratio below 1 is a loss.

- `labkit` is faster than all of them on {fastest} of {sets} sets, and faster than all exact ones \
on {exact} of {sets}.
- {lost} of {errors} errors are more than 5 % larger than the smallest error of the peers."""

LOSSES = """\
These are the errors that `labkit` loses by more than 5 %, with the peer that is best and how many
times `labkit`'s time it takes:"""


def in_short(results: dict[str, Any]) -> list[str]:
    """Point-to-line beside the peers that saw all pairs, in words and three tables."""
    times, errors, losses, fastest, exact = [], [], [], 0, 0
    for each in results["sets"].values():
        scores = each["matchers"]
        own = scores.get(LINE)
        peers = [name for name in scores if _is_peer(name) and _saw_all(each, name)]
        if own is None or not peers:
            continue
        first, first_exact = _quickest(scores, peers), _quickest(scores, _as_exact(scores, peers))
        fastest += _is_slower(scores, first)
        exact += _is_slower(scores, first_exact)
        compared = [_compared(scores, name) for name in (first, first_exact, LESSON)]
        times.append([each["title"], number(own["time_ms"]["median"], ".2f"), *compared])
        cells = []
        for label, (key, part, form) in ERRORS.items():
            who = min(peers, key=lambda name: _known(scores[name][key][part]))
            mine, best = own[key][part], scores[who][key][part]
            cells.append(f"{number(mine, form)} ({number(best, form)})")
            if _known(mine) > SLACK * _known(best):
                lost = f"{number(best, form)} ({who}, {_ratio(scores[who], own):.1f}\u00a0×)"
                losses.append([f"{each['title']}: {label}", number(mine, form), lost])
        errors.append([each["title"], *cells])
    if not times:
        return []
    words = {"sets": len(times), "errors": len(times) * len(ERRORS), "lost": len(losses)}
    return [
        SHORT.format(fastest=fastest, exact=exact, **words),
        markdown(["set", "ms", "fastest peer", "fastest exact peer", "the lesson"], times),
        markdown(["set", *ERRORS], errors),
        LOSSES,
        markdown(["set: error", "labkit", "best peer"], losses),
    ]


def point_to_point_rows(results: dict[str, Any]) -> list[list[str]]:
    """A row for each set: time, errors and time over labkit's of the point-to-point matchers."""
    rows = []
    for result in results["sets"].values():
        scores = result["matchers"]
        if POINT not in scores:
            continue
        for name in (POINT, *POINT_PEERS):
            if name in scores:
                score = scores[name]
                rows.append(
                    [
                        f"{result['title']}: {name}",
                        number(score["time_ms"]["median"], ".2f"),
                        f"{_ratio(score, scores[POINT]):.2f}\u00a0×",
                        *(number(score[key][part], form) for key, part, form in ERRORS.values()),
                    ]
                )
    return rows


def _quickest(scores: dict[str, Any], names: Sequence[str]) -> str | None:
    return min(names, key=lambda name: scores[name]["time_ms"]["median"], default=None)


def _is_slower(scores: dict[str, Any], name: str | None) -> bool:
    """Whether it takes longer than labkit; nobody does."""
    return name is None or _ratio(scores[name], scores[LINE]) > 1.0


def _as_exact(scores: dict[str, Any], names: Sequence[str]) -> list[str]:
    """Those that err and fail about as little as labkit does."""
    own = scores[LINE]
    return [
        name
        for name in names
        if scores[name]["failures"] <= own["failures"]
        and all(
            _known(scores[name][key][part]) <= 2.0 * _known(own[key][part])
            for key, part, _ in ERRORS.values()
        )
    ]


def _compared(scores: dict[str, Any], name: str | None) -> str:
    """The time of one, who it is, and how many times labkit's it is."""
    if name not in scores:
        return "–"
    who = "" if name == LESSON else f" ({name})"
    milliseconds = number(scores[name]["time_ms"]["median"], ".2f")
    return f"{milliseconds}{who}: {_ratio(scores[name], scores[LINE]):.2f}\u00a0×"


def _is_peer(name: str) -> bool:
    return not name.startswith(NO_PEERS)


def _saw_all(result: dict[str, Any], name: str) -> bool:
    return bool(result["matchers"][name]["pairs"] == result["pairs"])


def _ratio(slower: dict[str, Any], faster: dict[str, Any]) -> float:
    """How many times as long one takes as the other."""
    return slower["time_ms"]["median"] / faster["time_ms"]["median"]


def _known(value: float | None) -> float:
    """An error, infinite where too many pairs went unanswered."""
    return math.inf if value is None else value
