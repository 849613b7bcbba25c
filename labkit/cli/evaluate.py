"""``labkit evaluate``: how good a trajectory is, against another one or against a survey."""

from __future__ import annotations

import argparse

from labkit.arrays import FARTHEST, check_range
from labkit.cli.text import ERROR_HEADER, error_dict, error_row, table, to_json
from labkit.errors import InvalidPointsError
from labkit.evaluation import (
    PoseErrors,
    absolute_errors,
    associate,
    read_relations,
    relation_errors,
    rpe,
)
from labkit.logs import read_tum

DESCRIPTION = """\
Compare a trajectory (TUM format) with a reference trajectory: absolute error after rigid
alignment (ATE), relative error a step and over a stretch (RPE). Where the robot stays in
its place, no rigid alignment is the best one: the first poses are aligned, and the name of
the error says so. Or compare it with surveyed relations between pairs of scans (SLAM
benchmark format, or CSV i,j,dx,dy,dtheta)."""


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``evaluate`` to the command line."""
    parser = commands.add_parser(
        "evaluate",
        help="measure a trajectory against a reference or surveyed relations",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("estimate", metavar="ESTIMATE.tum", help="the trajectory to measure")
    against = parser.add_mutually_exclusive_group(required=True)
    against.add_argument("--reference", metavar="REF.tum", help="a better trajectory")
    against.add_argument("--relations", metavar="FILE", help="surveyed relative poses")
    parser.add_argument(
        "--stretch", type=float, default=10.0, metavar="M", help="RPE stretch [m] (default 10)"
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.02,
        metavar="S",
        help="how far two stamps of one moment may lie apart [s] (default 0.02)",
    )
    parser.add_argument("--json", action="store_true", help="print as JSON, metres and radians")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Measure and print."""
    check_range(args.stretch, "stretch", above=0.0, at_most=FARTHEST, unit="m")
    if args.relations is not None:
        errors, note = _against_relations(args)
    else:
        errors, note = _against_reference(args)
    if args.json:
        print(to_json({name: error_dict(e) | {"count": len(e)} for name, e in errors.items()}))
    else:
        print(note)
        print(table(ERROR_HEADER, [error_row(name, e) for name, e in errors.items()]))
    return 0


def _against_reference(args: argparse.Namespace) -> tuple[dict[str, PoseErrors], str]:
    stamps, estimate = read_tum(args.estimate)
    reference_stamps, reference = read_tum(args.reference)
    pairs = associate(stamps, reference_stamps, args.tolerance)
    if len(pairs) < 2:
        raise InvalidPointsError(
            f"{args.estimate} and {args.reference} share {len(pairs)} stamps within "
            f"{args.tolerance:g} s, but at least 2 are needed; are their clocks the same?"
        )
    x, x_reference = estimate[pairs[:, 0]], reference[pairs[:, 1]]
    kind, absolute = absolute_errors(x, x_reference)
    errors = {
        kind: absolute,
        "RPE, a step": rpe(x, x_reference),
        f"RPE, {args.stretch:g} m": rpe(x, x_reference, args.stretch, "metres"),
    }
    note = f"{len(pairs)} of {len(estimate)} poses have a partner in the reference"
    return errors, note


def _against_relations(args: argparse.Namespace) -> tuple[dict[str, PoseErrors], str]:
    stamps, estimate = read_tum(args.estimate)
    relations = read_relations(args.relations)
    errors = relation_errors(relations, estimate, stamps, tolerance=args.tolerance)
    if len(errors) == 0:
        raise InvalidPointsError(
            f"none of the {len(relations)} relations of {args.relations} joins two poses of "
            f"{args.estimate}; do they belong to the same log?"
        )
    note = f"{len(errors)} of {len(relations)} relations join two poses of the estimate"
    return {"relations": errors}, note
