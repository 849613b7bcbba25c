"""Time labkit beside the scan matchers that pip can install; JSON and tables come out.

Everything, or a part of it, or a log of one's own:

- ``python tests/bench/run.py --out results.json``
- ``python tests/bench/run.py --quick --sets rays-360 --matchers labkit Open3D``
- ``python tests/bench/run.py --log run.log --relations run.relations.csv --source "whose"``
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"
os.environ["VECLIB_MAXIMUM_THREADS"] = "1"

import argparse
import json
import sys
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from basin import basin
from data import SPLITS, PairSet, lesson_pairs, ray_pairs
from labkit.support.files import atomic_write
from machine import describe_machine, describe_versions, today
from peers import Matcher, load_matchers
from recorded import killian_pairs, surveyed_pairs
from scoring import score
from tables import basin_text, set_text
from timing import CLOCKS, measure

SETS: dict[str, Callable[[str, int], PairSet]] = {
    "lesson": lesson_pairs,
    "rays-180": partial(ray_pairs, beams=180, degrees=180.0),
    "rays-360": partial(ray_pairs, beams=360),
    "rays-1000": partial(ray_pairs, beams=1000, degrees=270.0),
    "rays-20000": partial(ray_pairs, beams=20_000),
    "rays-100000": partial(ray_pairs, beams=100_000),
    "rays-360-unordered": partial(ray_pairs, beams=360, ordered=False),
    "rays-20000-unordered": partial(ray_pairs, beams=20_000, ordered=False),
    "killian": killian_pairs,
}
BASIN_SETS = ("rays-360", "killian")
PAIRS, ROUNDS = 200, 3
QUICK_PAIRS, QUICK_ROUNDS = 20, 1


def main() -> int:
    """Run what was asked for, print each table as soon as it is there, write the JSON."""
    args = _parse()
    tqdm.monitor_interval = 0  # beside a thread, workers cannot be copies of this process
    warnings.simplefilter("ignore")  # the peers' own; labkit's are errors in its tests
    matchers, missing = load_matchers()
    for package, reason in missing.items():
        print(f"missing: {package} ({reason})", file=sys.stderr)
    matchers = [each for each in matchers if _wanted(each, args.matchers)]
    results: dict[str, Any] = {
        "date": today(),
        "machine": describe_machine(),
        "versions": describe_versions(),
        "missing": sorted(missing),
        "split": args.split,
        "rounds": args.rounds,
        "clock": args.clock,
        "sets": {},
        "basins": {},
    }
    for name, make in _sets(args).items():
        results["sets"][name] = _compare(matchers, make(args.split, args.pairs), args)
        print(set_text(results["sets"][name]), flush=True)
    for name in BASIN_SETS if args.basin else ():
        candidates = SETS[name](args.split, 3 * args.pairs)  # many lack structure
        results["basins"][name] = basin(matchers, candidates, args.pairs)
        print(basin_text(results["basins"][name]), flush=True)
    if args.out:
        with atomic_write(args.out) as file:
            file.write(to_json(results) + "\n")
    return 0


def to_json(results: dict[str, Any]) -> str:
    """JSON with null where there is no number."""
    text = json.dumps(results, default=np.ndarray.tolist)
    return json.dumps(json.loads(text, parse_constant=lambda _: None), indent=2)


def _compare(
    matchers: list[Matcher], pair_set: PairSet, args: argparse.Namespace
) -> dict[str, Any]:
    """Every matcher's score on one set."""
    runs = measure(matchers, pair_set, args.rounds)
    wall, processor = (sum(run.seconds(clock).sum() for run in runs.values()) for clock in CLOCKS)
    return {
        "title": pair_set.title,
        "reference": pair_set.reference,
        "source": pair_set.source,
        "gate": pair_set.gate,
        "pairs": len(pair_set.pairs),
        "wall_over_processor": float(wall / processor),
        "matchers": {name: score(pair_set, run, args.clock) for name, run in runs.items()},
    }


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, metavar="N", help=f"of each set (default {PAIRS})")
    parser.add_argument(
        "--rounds", type=int, metavar="R", help=f"over all pairs (default {ROUNDS})"
    )
    parser.add_argument("--split", choices=SPLITS, default="reporting")
    parser.add_argument("--sets", nargs="*", choices=SETS, default=list(SETS), metavar="SET")
    parser.add_argument("--matchers", nargs="+", metavar="NAME", help="parts of their names")
    parser.add_argument("--log", type=Path, action="append", default=[], help="may be repeated")
    parser.add_argument("--relations", type=Path, action="append", default=[], help="of each log")
    parser.add_argument(
        "--laser-offset",
        nargs=3,
        type=float,
        action="append",
        default=[],
        metavar=("X", "Y", "THETA"),
        help="of each log: the scanner's place on the robot [m, m, rad]",
    )
    parser.add_argument("--source", action="append", default=[], help="of each log: who made it")
    parser.add_argument(
        "--clock", choices=CLOCKS, default="wall", help="`processor` is for a busy machine"
    )
    parser.add_argument("--no-basin", dest="basin", action="store_false")
    parser.add_argument("--quick", action="store_true", help="few pairs, one round, to try it out")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the results as JSON")
    args = parser.parse_args()
    logs = len(args.log)
    if len(args.relations) != logs or {len(args.laser_offset), len(args.source)} - {0, logs}:
        parser.error(
            "give --relations with every --log; --laser-offset and --source with all or none"
        )
    args.pairs = args.pairs or (QUICK_PAIRS if args.quick else PAIRS)
    args.rounds = args.rounds or (QUICK_ROUNDS if args.quick else ROUNDS)
    return args


def _sets(args: argparse.Namespace) -> dict[str, Callable[[str, int], PairSet]]:
    """The built-in sets that were asked for, and the logs."""
    sets = {name: SETS[name] for name in args.sets}
    offsets = args.laser_offset or [(0.0, 0.0, 0.0)] * len(args.log)
    sources = args.source or [f"{log.name}, not in the project" for log in args.log]
    for log, relations, offset, source in zip(
        args.log, args.relations, offsets, sources, strict=True
    ):
        sets[log.name.partition(".")[0]] = partial(
            surveyed_pairs, log=log, relations=relations, laser_offset=offset, source=source
        )
    return sets


def _wanted(matcher: Matcher, names: list[str] | None) -> bool:
    return not names or any(name.lower() in matcher.name.lower() for name in names)


if __name__ == "__main__":
    sys.exit(main())
