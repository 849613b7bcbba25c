"""``labkit odometry``: the main job, from a log to a trajectory, a map and a quality file."""

from __future__ import annotations

import argparse
import math
import sys
import time
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import fields, replace

import numpy as np

from labkit.cli.outputs import WRITERS, Run, make_sure_of_room, output_paths, write_files
from labkit.cli.reading import add_log_options, progress, read
from labkit.evaluation import PoseErrors, compare
from labkit.logs import Log
from labkit.odometry import (
    Decision,
    OdometryParameters,
    OdometryResult,
    estimate_odometry,
    increments_between,
    integrate,
)
from labkit.simulation import WheelNoise, wheel_increments
from labkit.support.arrays import FloatArray, check_count
from labkit.support.errors import InvalidParameterError, InvalidPointsError
from labkit.support.interrupts import loading
from labkit.support.warm import warm

DESCRIPTION = """\
Estimate the motion of a robot from its laser scans, step by step, with sanity checks and
fallbacks. LOG is a CARMEN or g2o log, a ROS bag, a table of points or of ranges, an array of numpy
(the format is told from the content; `-` is standard input), or `killian`: a real run of 1.9 km
that comes with the lab.

The prior is where a step's search begins, and what it falls back to: the log's own odometry or
that of `--odometry`, else the motion of the step before. For `killian` it is wheel odometry
simulated from its reference: per step, sd 10 % of the way along and 5 % across, 10 % of the turn
and 0.05 rad/m of heading."""

SIMULATED_WHEELS = WheelNoise(along=0.10, across=0.05, turn=0.10, drift=0.05)
SHORT = {
    "max_correspondence_distance": "--gate",
    "overlap_ratio": "--overlap",
    "huber_delta": "--huber",
}
OPTIONS = {  # fields of `OdometryParameters`, and those of their fields that are options
    "icp": tuple(SHORT),
    "limits": ("max_translation",),
}


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``odometry`` to the command line."""
    formatter = argparse.RawDescriptionHelpFormatter
    about = "estimate the motion of a whole log"
    parser = commands.add_parser(
        "odometry", help=about, description=DESCRIPTION, formatter_class=formatter
    )
    parser.set_defaults(run=run)
    add_log_options(parser)
    add = parser.add_argument
    add("--prior", choices=("auto", "none"), default="auto", help="none: leave odometry aside")
    skew = "none: leave the motion within a sweep aside, where the log tells the time of its beams"
    add("--deskew", choices=("auto", "none"), default="auto", help=skew)
    files = (
        f"PREFIX of {', '.join(WRITERS)} (default the log's name), or a folder for files of the "
        f"log's name; `none` writes nothing"
    )
    add("--out", metavar="PREFIX", help=files)
    _add_parameters(parser)


def _add_parameters(parser: argparse.ArgumentParser) -> None:
    """Add an option for each field in `OPTIONS`; default, meaning and unit are the field's."""
    for part, names in OPTIONS.items():
        group = parser.add_argument_group(part)
        defaults = getattr(OdometryParameters(), part)
        for field in fields(defaults):
            if field.name in names:
                default = getattr(defaults, field.name)
                unit = field.metadata.get("unit", "–")
                standing = field.metadata.get("default", default)
                meaning = f"{field.metadata['help']} [{unit}] (default {standing})"
                group.add_argument(
                    flag(field.name),
                    dest=field.name,
                    type=float,
                    default=default,
                    metavar="X",
                    help=meaning,
                )


def flag(name: str) -> str:
    """Option of a field: its own name, or a short one."""
    return SHORT.get(name, "--" + name.replace("_", "-"))


def run(args: argparse.Namespace) -> int:
    """Estimate the motion, print a summary and write the files; 1 where a file is not written."""
    if args.odometry is not None and args.prior == "none":
        raise InvalidParameterError("leaves `--odometry` aside: drop one", parameter="prior")
    if args.scans is not None:
        check_count(args.scans, "scans", at_least=2)
    parameters = _parameters(args)
    log = read(args)
    if len(log) < 2:
        way = "; a column `scan` tells scans apart" if log.format in {"points", "polar"} else ""
        raise InvalidPointsError(f"{log.name} holds a single scan; a motion needs two{way}")
    paths = output_paths(args.out, log.name, [args.log, args.odometry])
    make_sure_of_room(paths, len(log))
    prior, source = (None, "the last motion") if args.prior == "none" else choose_prior(log)
    source = source if args.odometry is None else f"the odometry of {args.odometry}"
    if not args.quiet:
        print(f"{log.name}: {len(log)} scans, prior: {source}", flush=True)
    start = np.zeros(3) if log.reference is None else log.reference[0]
    with loading():
        warm()  # compiling is no time of a step
    began = time.process_time()
    deskew = args.deskew == "auto"
    show = progress(args, "matching", "scan")
    with warnings.catch_warnings(action="ignore"):  # the remarks are told below
        result = estimate_odometry(
            log.scans, prior, parameters, start=start, deskew=deskew, progress=show
        )
    seconds = time.process_time() - began
    wheels = None if prior is None or not np.isfinite(prior).all() else integrate(prior, start)
    for remark in result.remarks:
        print(f"note: {remark}", file=sys.stderr)
    if not args.quiet:
        print(_decisions(result, seconds))
        _print_errors(log, result, wheels)
    written, errors = write_files(paths, Run(log=log, result=result, wheels=wheels))
    if written and not args.quiet:
        print("wrote " + ", ".join(written))
    for error in errors:
        print(f"labkit odometry: {error}", file=sys.stderr)
    return 1 if errors else 0


def _parameters(args: argparse.Namespace) -> OdometryParameters:
    defaults = OdometryParameters()
    parts = {
        part: replace(getattr(defaults, part), **{name: getattr(args, name) for name in names})
        for part, names in OPTIONS.items()
    }
    return replace(defaults, **parts)


def _print_errors(log: Log, result: OdometryResult, wheels: FloatArray | None) -> None:
    """Print the errors against the log's reference, if it has one."""
    if log.reference is None:
        return
    trajectories = {"odometry": result.poses}
    if wheels is not None:
        trajectories["prior"] = wheels
    errors = compare(trajectories, log.reference)
    print(table(ERROR_HEADER, [error_row(name, each) for name, each in errors.items()]))


def choose_prior(log: Log) -> tuple[FloatArray | None, str]:
    """Increments (K−1, 3) from which the steps start, and the name of their origin."""
    if log.odometry is not None:
        return increments_between(log.odometry), "the log's odometry"
    if log.name == "killian" and log.reference is not None:
        increments = wheel_increments(log.reference, SIMULATED_WHEELS, rng=0)
        return increments, "wheel odometry simulated from the reference, seed 0"
    return None, "the last motion"


def _decisions(result: OdometryResult, seconds: float) -> str:
    """Summary of where the steps came from."""
    steps = len(result.records) - 1
    search = result.count(Decision.SEARCH)
    matched = sum(record.decision.matched for record in result.records)
    prior = result.count(Decision.PRIOR)
    skipped = result.count(Decision.HOLD, Decision.STAND)
    degenerate = sum(record.degenerate for record in result.records)
    doubtful = sum(record.is_doubtful for record in result.records)
    return (
        f"{steps} steps in {seconds:.1f} s of processor time ({1e3 * seconds / steps:.2f} ms a "
        f"step): {matched} matched ({search} after a search, {result.against_prior} against the "
        f"prior), {prior} from the prior, {skipped} skipped; {degenerate} degenerate, "
        f"{doubtful} doubtful"
    )


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Align columns under a header: the first to the left, the others to the right."""
    cells = [list(header), *map(list, rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    lines = []
    for row in cells:
        numbers = map(str.rjust, row[1:], widths[1:])
        lines.append("  ".join([row[0].ljust(widths[0]), *numbers]).rstrip())
    return "\n".join(lines)


ERROR_HEADER = ("error", "median", "p95", "max", "rmse", "", "median", "p95", "max", "rmse")


def error_row(name: str, errors: PoseErrors) -> list[str]:
    """Translation errors in metres and rotation errors in degrees, for `ERROR_HEADER`."""
    t, r = errors.translation, errors.rotation
    metres = [f"{value:.3f} m" for value in (t.median, t.p95, t.max, t.rmse)]
    degrees = [f"{math.degrees(value):.3f}°" for value in (r.median, r.p95, r.max, r.rmse)]
    return [name, *metres, "|", *degrees]
