"""Which rows of the disturbances move if a number of the odometry is a third larger.

``nice python tests/bench/vary.py CSAIL ACES --out FILE`` runs some rows of both logs with each of
`labkit.odometry.constants` a third larger, two runs at a time, and as it is with three seeds. A row
moves if its ATE lies outside those three by a quarter. ``vary.py --page FILE`` writes
``tests/bench/vary.md``; ``--only NAME...`` varies these numbers alone.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
from collections.abc import Sequence
from functools import partial
from itertools import chain
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from disturbances import drive_of, measure  # before numpy: it asks for one thread
from labkit import __version__
from labkit.odometry import constants
from labkit.support.warm import warm
from tables import markdown

NAMES = [name for name in vars(constants) if name.isupper()]
THIRD = 4.0 / 3.0
SEEDS = 3
MARGIN = 1.25
ROWS = (  # log, disturbance, with wheels
    (0, "clean", True),
    (0, "clean", False),
    (0, "a quarter of the beams", True),
    (0, "gaps of 5 scans", True),
    (0, "every 2nd scan", True),
    (1, "clean", True),
    (1, "people ahead", True),
    (1, "wheels slip 0.5–2 m", True),
    (1, "wheels stand for 30 steps", True),
)


def factor_of(value: object) -> float:
    """By how much a number is varied: a third more, or as much less if a share would exceed 1."""
    is_share = isinstance(value, float) and value < 1.0 <= THIRD * value
    return 1.0 / THIRD if is_share else THIRD


def vary(name: str) -> None:
    """Make a constant of the odometry larger by its factor, in all modules; this process ends."""
    value = getattr(constants, name)
    factor = factor_of(value)
    if isinstance(value, tuple):
        varied = tuple(factor * part for part in value)
    else:
        varied = type(value)(factor * value)
    for module in list(sys.modules.values()):
        if module.__name__.startswith("labkit.odometry") and hasattr(module, name):
            setattr(module, name, varied)


def measure_with(task: tuple[str | None, int], logs: Sequence[str]) -> list[dict[str, Any]]:
    """The runs of all rows, with one number a third larger, or with none; of a process alone."""
    name, seed = task
    if name is not None:
        vary(name)
    runs = [(logs[log], None, row, wheels, seed) for log, row, wheels in ROWS]
    return [{"vary": name, **measure(run)} for run in runs]


def page(results: list[dict[str, Any]], version: str) -> str:
    """The table of all numbers, and the rows that each of them moves."""
    before: dict[str, list[float]] = {}
    after: dict[str, dict[str, float]] = {}
    for run in results:
        wheels = "" if run["wheels"] else ", no wheels"
        row = f"{run['log']}, {run['disturbance']}{wheels}"
        if run["vary"] is None:
            before.setdefault(row, []).append(run["ate"])
        else:
            after.setdefault(run["vary"], {})[row] = run["ate"]
    rows = []
    for name in filter(after.__contains__, NAMES):
        worse, better = [], []
        for row, ate in after[name].items():
            text = f"{row}: {ate:.2f}"
            if ate > MARGIN * max(before[row]):
                worse.append(text)
            elif MARGIN * ate < min(before[row]):
                better.append(text)
        rows.append([f"`{name}`", "; ".join(worse) or "–", "; ".join(better) or "–"])
    as_is = [
        [row, *(f"{value:.2f}" for value in (statistics.median(ates), min(ates), max(ates)))]
        for row, ates in before.items()
    ]
    parts = [
        INTRO.format(version),
        markdown(("row", "median", "smallest", "largest"), as_is),
        markdown(("number", "a third larger: worse", "better"), rows),
    ]
    return "\n\n".join(parts) + "\n"


INTRO = """\
# Each number of the odometry, a third larger

ATE in metres, seed 0; a share that would exceed 1 is made a third smaller. A row stands here if its
run ends outside those of three seeds with all numbers as they are, the first table, by a quarter.
`tests/bench/vary.py` writes this page. Measured was labkit {}."""


def main() -> int:
    """Run, or write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="*", metavar="LOG")
    parser.add_argument("--only", nargs="+", default=NAMES, metavar="NAME")
    parser.add_argument("--jobs", type=int, default=2, metavar="N")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the results, JSON lines")
    parser.add_argument("--page", nargs="+", type=Path, metavar="FILE", help="results to write up")
    parser.add_argument("--measured", default=__version__, help="the version, for the page")
    args = parser.parse_args()
    if args.page:
        lines = chain.from_iterable(path.read_text("utf-8").splitlines() for path in args.page)
        text = page([json.loads(line) for line in lines], args.measured)
        Path(__file__).with_suffix(".md").write_text(text, encoding="utf-8")
        return 0
    tasks = [*((None, seed) for seed in range(SEEDS)), *((name, 0) for name in args.only)]
    for log in args.logs:
        drive_of(log, None)  # for all processes
    # A process of its own for each, so that no number stays changed.
    with (
        Pool(args.jobs, warm, maxtasksperchild=1) as pool,
        open(args.out or os.devnull, "w", encoding="utf-8") as out,
    ):
        for runs in pool.imap(partial(measure_with, logs=args.logs), tasks):
            out.writelines(f"{json.dumps(run)}\n" for run in runs)
            out.flush()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
