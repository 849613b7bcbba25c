"""Turn the results of `run.py` into a page of the book, with its figures.

``python tests/bench/report.py results.json`` writes ``book/benchmark.md``, the figures that it
shows and a copy of the results, into ``book/_static``. The same results give the same bytes.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import matplotlib as mpl

from figures import error_time_figure
from in_short import ERRORS, in_short, point_to_point_rows
from labkit.support.files import atomic_write
from tables import (
    HEADER,
    basin_rows,
    markdown,
    score_rows,
)

TIGHT: dict[str, Any] = {"dpi": 200, "bbox_inches": "tight", "pad_inches": 0.08}
BOOK = Path(__file__).parents[2] / "book"
INTRO = """\
# Benchmark

A comparison with other libraries: how fast and how exact is the lab's matcher? Every matcher
below got the same pairs of scans, the same guess, the same gate and one thread. The matchers took
turns of twenty pairs each, so the machine was the same for all of them. The time includes search
trees and normals, and ends with the pose. libpointmatcher is not among them: PyPI and Debian do not
have it. Measured was labkit %s; `make bench` measures the lab that is here, and writes this page
again. You can also download the numbers {download}`as JSON <_static/benchmark.json>`."""

ERROR_FIGURE = """\
```{figure} _static/benchmark-error.svg
:name: benchmark-error
:alt: Median translation error against median time of every matcher, a panel for each data set; \
the tables below hold the numbers

Median translation error against median time per pair, both on logarithmic axes. Lower left is
better. A matcher that was too slow to be tried on every pair is only in the tables.
```"""

SETS = """\
## Sets

Times are in milliseconds per pair, errors of translation in millimetres, and errors of rotation
in degrees. Each has its median and its 95th percentile. A match fails when it is off by more
than 0.3 m or 5°. The parameters were chosen on other pairs than those reported here. Karto's
matcher searches a square around the guess, as wide as the gate. It needs the beams of a sweep, so
the sets of bare points are without it. The lesson's listing is not tried on 20,000 points or more.
Sets of long sweeps have few pairs, so their 95th percentile is the largest of their errors, or
nearly so. The peers' settings are those for at most 1,000 points. At 20,000, the five or ten
neighbours that give them their normals span less than the noise."""

EQUAL_ERROR = """\
## Point to point at equal error

Here `labkit` matches as small_gicp's ICP does: all pairs within the gate count, they count alike,
and the run ends at a step below 1 mm and 1 mrad. Up to 1,000 points the two err about alike; above,
`labkit` errs less, and takes longer where the ratio is below 1. Open3D ends when fitness and RMSE
change by less than one in ten thousand, and MRPT narrows its gate to 0.1 m. The lesson's own
parameters, which keep 85 % of the pairs and weigh far ones down, are in no table."""

BASIN = """\
## Basin of convergence

These tables show the share of pairs that end within 50 mm and 1° of the answer. Each match
starts a given distance and angle away from the answer, in a random direction, under a gate of
0.5 m. Only pairs whose surfaces fix the motion in every direction count. For recorded pairs the
answer is the place where point-to-line ends when it starts at the reference, if the lesson's
point-to-point ends there, too."""


def main() -> int:
    """Write the page and its figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, help="the JSON that run.py wrote")
    parser.add_argument("--book", type=Path, default=BOOK, help="the folder of the book's pages")
    args = parser.parse_args()
    text = args.results.read_text(encoding="utf-8")
    results = json.loads(text)
    day = datetime.fromisoformat(results["date"]).replace(tzinfo=UTC)
    os.environ["SOURCE_DATE_EPOCH"] = str(int(day.timestamp()))  # the figures' own date
    static = args.book / "_static"
    with mpl.rc_context({"svg.hashsalt": "benchmark"}):
        error_time_figure(results).savefig(static / "benchmark-error.svg", **TIGHT)
    for path, content in {
        static / "benchmark.json": text,
        args.book / "benchmark.md": page(results),
    }.items():
        with atomic_write(path) as file:
            file.write(content)
    return 0


def page(results: dict[str, Any]) -> str:
    """The page as MyST Markdown: a section for all that was measured."""
    parts = [INTRO % results["versions"]["labkit"], _absent(results["missing"])]
    parts += [*in_short(results), ERROR_FIGURE, SETS]
    parts += map(_set_section, results["sets"].values())
    if rows := point_to_point_rows(results):
        parts += [EQUAL_ERROR, markdown(["set: matcher", "ms", "over labkit's", *ERRORS], rows)]
    if results["basins"]:
        parts += [BASIN, *map(_basin_section, results["basins"].values())]
    parts = [part for part in parts if part]
    return "\n\n".join([*parts, f"## Conditions\n\n{_conditions(results)}"]) + "\n"


def _absent(packages: list[str]) -> str:
    if not packages:
        return ""
    names = " and ".join(packages)
    return f"Not measured: {names}. No set has it."


def _set_section(result: dict[str, Any]) -> str:
    title = result["title"][0].upper() + result["title"][1:]
    source = f" Data: {result['source']}." if result["source"] else ""
    intro = (
        f"{result['pairs']} pairs under a gate of {result['gate']} m; "
        f"the reference: {result['reference']}.{source}"
    )
    return f"### {title}\n\n{intro}\n\n{markdown(HEADER, score_rows(result['matchers']))}"


def _basin_section(result: dict[str, Any]) -> str:
    starts = next(iter(result["shares"].values()))
    title = f"{result['title'][0].upper()}{result['title'][1:]}, {result['pairs']} pairs:"
    return f"{title}\n\n{markdown(['matcher', *starts], basin_rows(result))}"


def _conditions(results: dict[str, Any]) -> str:
    machine = results["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    busy = [each["wall_over_processor"] for each in results["sets"].values()]
    clock = "a watch" if results["clock"] == "wall" else "the processor's own clock"
    lines = [
        f"- {results['date']}; {machine['cpu']}, one of {machine['cores']} cores; "
        f"{machine['system']}",
        f"- {versions}",
        f"- rounds over the {results['split']} pairs: {results['rounds']}",
        f"- times by {clock}; elapsed time was {min(busy):.2f} to {max(busy):.2f} times the "
        f"processor's time (1 on a machine that does nothing else)",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
