"""``labkit evaluate``: the errors of a trajectory against a better one."""

from __future__ import annotations

import argparse

from labkit.cli.text import ERROR_HEADER, error_dict, error_row, table, to_json
from labkit.evaluation import associate, compare
from labkit.logs import read_tum
from labkit.support.errors import InvalidPointsError

HELP = "measure a trajectory against a reference"
DESCRIPTION = """\
Compare a trajectory (TUM format) with a reference trajectory: absolute error after rigid
alignment (ATE), relative error a step and over a stretch (RPE). Where the robot stays in
its place, no rigid alignment is the best one: the first poses are aligned, and the name of
the error says so."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add = parser.add_argument
    add("estimate", metavar="ESTIMATE.tum", help="the trajectory to measure")
    add("--reference", metavar="REF.tum", required=True, help="a better trajectory")
    add("--stretch", type=float, default=10.0, metavar="M", help="RPE stretch [m] (default 10)")
    far = "how far two stamps of one moment may lie apart [s] (default 0.02)"
    add("--tolerance", type=float, default=0.02, metavar="S", help=far)
    add("--json", action="store_true", help="print as JSON, metres and radians")


def run(args: argparse.Namespace) -> int:
    """Measure and print."""
    stamps, estimate = read_tum(args.estimate)
    reference_stamps, reference = read_tum(args.reference)
    pairs = associate(stamps, reference_stamps, args.tolerance)
    if len(pairs) < 2:
        raise InvalidPointsError(
            f"{args.estimate} and {args.reference} share {len(pairs)} stamps within "
            f"{args.tolerance:g} s, but at least 2 are needed; are their clocks the same?"
        )
    poses = {"estimate": estimate[pairs[:, 0]]}
    errors = compare(poses, reference[pairs[:, 1]], args.stretch)
    if args.json:
        print(to_json({name: error_dict(each) for name, each in errors.items()}))
    else:
        print(f"{len(pairs)} of {len(estimate)} poses have a partner in the reference")
        print(table(ERROR_HEADER, [error_row(name, each) for name, each in errors.items()]))
    return 0
