"""Turn the results of `run.py` into a page of the book, with its figures.

``python tests/bench/report.py results.json`` writes ``book/benchmark.md`` and the figures
that it shows, into ``book/_static``.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from figures import error_time_figure, growth_figure
from labkit.logs import atomic_write
from labkit.plotting import save_figure
from tables import HEADER, basin_rows, growth_rows, score_rows

BOOK = Path(__file__).parents[2] / "book"
LINE = "labkit point-to-line"
LESSON = "the lesson's listing"
NOT_FROM_PIP = ("labkit", LESSON, "MRPT")

PAGE = """\
# Benchmark

How fast and how exact is the lab's matcher beside those that people use? Every matcher below had
the same pairs of scans, the same guess, the same gate and one thread, and the matchers took turns,
pair by pair, so that all of them met the same machine. Search trees and normals are part of the
time. `make bench` repeats it.

{verdict}

```{{figure}} _static/benchmark-error.svg
:name: benchmark-error
:alt: Median translation error against median time of every matcher, a panel for each data set

Median translation error against median time a pair, both on logarithmic axes. Lower left is better.
A matcher that was too slow to be tried on every pair stands in the tables alone.
```

## Sets

Time is in milliseconds a pair, the error of translation in millimetres and that of rotation in
degrees, each with its median and its 95th percentile. A match fails when it is off by more than
0.3 m or 5°. Parameters were chosen on other pairs than those that are reported here.

{sets}

## Basin of convergence

The share of pairs that end within 50 mm and 1° of the answer when they start a given distance and
angle away from it, in a random direction, under a gate of 0.5 m. Only pairs whose surface fixes the
motion in every direction are asked for; the answer on recorded pairs is where the reference is
drawn to by point-to-line, if the lesson's point-to-point is drawn to the same place.

{basins}

## Growth

```{{figure}} _static/benchmark-growth.svg
:name: benchmark-growth
:alt: Median time a pair against the number of points of a scan, a line for each matcher

Median time a pair against the number of points, both on logarithmic axes. A matcher that needs more
than three seconds a pair is spared the larger scans.
```

{growth}

## Conditions

{conditions}
"""


def main() -> int:
    """Write the page and its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="the JSON that run.py wrote")
    parser.add_argument("--book", type=Path, default=BOOK, help="the folder of the book's pages")
    args = parser.parse_args()
    results = json.loads(args.results.read_text(encoding="utf-8"))
    if not results["basins"] or "growth" not in results:
        parser.error(f"{args.results} is not a whole run; leave --no-basin and --no-growth away")
    save_figure(error_time_figure(results), args.book / "_static" / "benchmark-error.svg")
    save_figure(growth_figure(results), args.book / "_static" / "benchmark-growth.svg")
    with atomic_write(args.book / "benchmark.md") as file:
        file.write(page(results))
    return 0


def page(results: dict[str, Any]) -> str:
    """The page as MyST Markdown."""
    return PAGE.format(
        verdict=_verdict(results),
        sets="\n\n".join(map(_set_section, results["sets"].values())),
        basins="\n\n".join(map(_basin_section, results["basins"].values())),
        growth=_markdown(
            ["ms a pair", *(f"{size:,}" for size in results["growth"]["points"])],
            growth_rows(results["growth"]),
        ),
        conditions=_conditions(results),
    )


def _verdict(results: dict[str, Any]) -> str:
    """Point-to-line beside the fastest and the closest peer from pip that saw all pairs."""
    rows = []
    for each in results["sets"].values():
        scores = each["matchers"]
        whole = [name for name in scores if scores[name]["pairs"] == each["pairs"]]
        peers = [name for name in whole if _from_pip(name)]
        fastest = min(peers, key=lambda name: scores[name]["time_ms"]["median"])
        closest = min(peers, key=lambda name: _error(scores[name]))
        own = scores[LINE]
        rows.append(
            [
                each["title"],
                _beside(own, "time_ms", ".2f"),
                f"{_beside(scores[fastest], 'time_ms', '.2f')} ({fastest})",
                f"{_ratio(scores[LESSON], own):.0f} ×",
                _beside(own, "translation_mm", ".1f"),
                f"{_beside(scores[closest], 'translation_mm', '.1f')} ({closest})",
            ]
        )
    header = ["set", "ms", "fastest from pip", "to the lesson's", "mm", "closest from pip"]
    return f"In short, {LINE} beside the best that pip has (medians):\n\n" + _markdown(header, rows)


def _set_section(result: dict[str, Any]) -> str:
    title = result["title"][0].upper() + result["title"][1:]
    intro = (
        f"{result['pairs']} pairs under a gate of {result['gate']} m; "
        f"the reference: {result['reference']}."
    )
    return f"### {title}\n\n{intro}\n\n{_markdown(HEADER, score_rows(result['matchers']))}"


def _basin_section(result: dict[str, Any]) -> str:
    starts = next(iter(result["shares"].values()))
    title = f"{result['title'][0].upper()}{result['title'][1:]}, {result['pairs']} pairs:"
    return f"{title}\n\n{_markdown(['matcher', *starts], basin_rows(result))}"


def _conditions(results: dict[str, Any]) -> str:
    machine = results["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    lines = [
        f"- {results['date']}; {machine['cpu']}, one of {machine['cores']} cores; "
        f"{machine['system']}",
        f"- {versions}",
        f"- {results['rounds']} rounds over the {results['split']} pairs",
    ]
    if results["missing"]:
        lines.append(f"- not installed, so not here: {', '.join(results['missing'])}")
    return "\n".join(lines)


def _markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table whose first column is words and whose others are numbers."""
    rule = [":--", *("--:" for _ in header[1:])]
    return "\n".join(f"| {' | '.join(line)} |" for line in [header, rule, *rows])


def _from_pip(name: str) -> bool:
    return not name.startswith(NOT_FROM_PIP)


def _beside(score: dict[str, Any], key: str, form: str) -> str:
    value = score[key]["median"]
    return "–" if value is None else format(value, form)


def _ratio(slower: dict[str, Any], faster: dict[str, Any]) -> float:
    return slower["time_ms"]["median"] / faster["time_ms"]["median"]


def _error(score: dict[str, Any]) -> float:
    """The median translation error; infinite where most pairs went unanswered."""
    median = score["translation_mm"]["median"]
    return math.inf if median is None else median


if __name__ == "__main__":
    sys.exit(main())
