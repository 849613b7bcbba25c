"""``labkit odometry``: the main job, from a log to a trajectory, a map and a quality file."""

from __future__ import annotations

import argparse
import time
from functools import partial

import numpy as np
from tqdm import tqdm

from labkit.arrays import FloatArray, check_count
from labkit.cli.log_options import add_log_options, open_log
from labkit.cli.options import add_icp_options, add_options, from_options
from labkit.cli.outputs import add_output_options, choose_outputs
from labkit.cli.summary import decision_text, error_text
from labkit.errors import InvalidPointsError
from labkit.filters import Preprocessing
from labkit.logs import Log, LogStream
from labkit.odometry import (
    MapParameters,
    OdometryParameters,
    SanityLimits,
    estimate_odometry,
    increments_between,
)
from labkit.parameters import IcpParameters
from labkit.simulation import WheelNoise, wheel_increments
from labkit.warm import warm

DESCRIPTION = """\
Estimate the motion of a robot from its laser scans, step by step, with sanity checks and
fallbacks. LOG is a CARMEN or g2o log, a ROS bag, a CSV of points (the format is told from
the content), or `killian`: a real run of 1.9 km that comes with the lab.

The prior is where a step's search begins, and what it falls back to:
  log        the log's own odometry
  simulated  wheel odometry simulated from the log's reference: per step, sd 10 % of the way
             along and 5 % across, 10 % of the turn and 0.05 rad/m of heading
  none       the motion of the step before
  auto       the first of these that the log allows (the default)

A scan is matched against a map of the last key scans, or against the scan before it
(--against scan)."""

SIMULATED_WHEELS = WheelNoise(along=0.10, across=0.05, turn=0.10, drift=0.05)
FALLBACKS = "search", "on_skip"


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``odometry`` to the command line."""
    parser = commands.add_parser(
        "odometry",
        help="estimate the motion of a whole log",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("log", metavar="LOG", help="a log file, or `killian`")
    parser.add_argument(
        "--prior", choices=("auto", "log", "simulated", "none"), default="auto", help="see above"
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the simulated prior (default 0)"
    )
    parser.add_argument(
        "--scans", type=int, metavar="N", help="use the first N scans only (default all)"
    )
    add_log_options(parser)
    add_output_options(parser)
    defaults = OdometryParameters()
    add_icp_options(parser, defaults.icp)
    add_options(parser, "map", defaults, names=("against",))
    add_options(parser, "key scans", defaults.map)
    add_options(parser, "sanity checks", defaults.limits)
    add_options(parser, "fallbacks", defaults, names=FALLBACKS)
    add_options(parser, "filters", defaults.preprocessing)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Estimate the motion, write what was asked for and print a summary."""
    parameters = from_options(
        OdometryParameters,
        args,
        icp=from_options(IcpParameters, args),
        limits=from_options(SanityLimits, args),
        map=from_options(MapParameters, args),
        preprocessing=from_options(Preprocessing, args),
    )
    check_count(args.seed, "seed", at_least=0)
    log = _head(open_log(args), args.scans)
    outputs = choose_outputs(args, log.name)
    prior, source = choose_prior(log, args.prior, args.seed)
    print(f"{log.name}: {len(log)} scans, {parameters.icp.metric} metric, prior: {source}")
    start = np.zeros(3) if log.reference is None else log.reference[0]
    warm()
    began = time.perf_counter()
    progress = partial(tqdm, unit="scan", desc="matching", disable=None)
    result = estimate_odometry(log.scans, prior, parameters, start=start, progress=progress)
    seconds = time.perf_counter() - began
    for path, write in outputs:
        write(path, log, result)
    if outputs:
        print("wrote " + ", ".join(path for path, _ in outputs))
    print(decision_text(result, seconds))
    if log.reference is not None:
        print(error_text(log.reference, result, prior))
    return 0


def choose_prior(log: Log | LogStream, wanted: str, seed: int) -> tuple[FloatArray | None, str]:
    """Increments (K−1, 3) that a run starts its steps from, and a word on their origin."""
    if wanted == "auto":
        allowed = {"log": log.odometry, "simulated": log.reference}
        wanted = next((name for name, poses in allowed.items() if poses is not None), "none")
    if wanted == "none":
        return None, "the last motion"
    if wanted == "log":
        if log.odometry is None:
            raise InvalidPointsError(
                f"{log.name} holds no odometry for `--prior log`; try `--prior none`"
            )
        return increments_between(log.odometry), "the log's odometry"
    if log.reference is None:
        raise InvalidPointsError(
            f"{log.name} holds no reference to simulate wheels from; try `--prior none`"
        )
    increments = wheel_increments(log.reference, SIMULATED_WHEELS, rng=seed)
    return increments, f"wheel odometry simulated from the reference, seed {seed}"


def _head(log: Log | LogStream, scans: int | None) -> Log | LogStream:
    """The first scans of the log, and the poses that belong to them; two at the least."""
    if scans is not None:
        check_count(scans, "scans", at_least=2)
    if len(log) < 2:
        raise InvalidPointsError(f"{log.name} holds a single scan; a motion needs two")
    return log if scans is None else log.head(scans)
