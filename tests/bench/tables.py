"""Results as text: a table for each set, and the basins."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from labkit.cli.odometry import table

HEADER = ("matcher", "ms", "p95", "steps", "mm", "p95", "deg", "p95", "failed")


def score_rows(scores: dict[str, Any]) -> list[list[str]]:
    """A row for each matcher under `HEADER`, the fastest first."""
    by_time = sorted(scores.items(), key=lambda item: item[1]["time_ms"]["median"])
    most = max(each["pairs"] for each in scores.values())
    return [
        [
            name if each["pairs"] == most else f"{name} ({each['pairs']} pairs)",
            *_pair(each["time_ms"], ".2f"),
            "–" if each["iterations"] is None else f"{each['iterations']:.0f}",
            *_pair(each["translation_mm"], ".2f"),
            *_pair(each["rotation_deg"], ".3f"),
            str(each["failures"]),
        ]
        for name, each in by_time
    ]


def basin_rows(basin: dict[str, Any]) -> list[list[str]]:
    """A row for each matcher: the share found from each start, in percent."""
    return [
        [name, *(f"{100.0 * share:.1f} %" for share in shares.values())]
        for name, shares in basin["shares"].items()
    ]


def set_text(result: dict[str, Any]) -> str:
    """One set for a terminal."""
    title = f"{result['title']}: {result['pairs']} pairs, gate {result['gate']} m"
    return f"{title}\n{table(HEADER, score_rows(result['matchers']))}\n"


def basin_text(basin: dict[str, Any]) -> str:
    """One basin for a terminal."""
    starts = next(iter(basin["shares"].values()))
    title = f"basin, {basin['title']}: {basin['pairs']} pairs"
    return f"{title}\n{table(['matcher', *starts], basin_rows(basin))}\n"


def number(value: float | None, form: str) -> str:
    """A number, or a dash where there is none."""
    return "–" if value is None or value == float("inf") else format(value, form)


def _pair(summary: dict[str, float | None], form: str) -> list[str]:
    return [number(summary["median"], form), number(summary["p95"], form)]


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table whose first column is words and whose others are numbers."""
    rule = [":--", *("--:" for _ in header[1:])]
    return "\n".join(f"| {' | '.join(line)} |" for line in [header, rule, *rows])
