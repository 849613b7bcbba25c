"""``labkit match``: the transform between two scans in CSV files."""

from __future__ import annotations

import argparse
import math
import sys

from labkit.cli.options import MATCHING, add_options, chosen
from labkit.cli.text import pose_text
from labkit.icp import icp
from labkit.logs import read_log
from labkit.parameters import IcpParameters
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.se2 import from_xytheta, to_xytheta
from labkit.support.errors import InvalidParameterError, LogError

HELP = "match two scans of x,y in metres"
DESCRIPTION = """\
Find the rigid transform that maps the points of SOURCE (the newer scan) onto TARGET (the
older one). Each file holds one point a line, `x,y` in metres."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add, pose = parser.add_argument, ("X", "Y", "THETA")
    guess = "initial guess in metres and radians (default 0 0 0)"
    add("target", metavar="TARGET", help="the older scan, CSV")
    add("source", metavar="SOURCE", help="the newer scan, CSV")
    add("--initial", nargs=3, type=float, default=(0.0, 0.0, 0.0), metavar=pose, help=guess)
    add_options(parser, "matching", IcpParameters(), MATCHING)


def run(args: argparse.Namespace) -> int:
    """Match the two files and print the result; status 1 where they do not match."""
    if not all(map(math.isfinite, args.initial)):
        raise InvalidParameterError(
            f"must be three finite numbers x, y, theta, got {args.initial}", parameter="initial"
        )
    target, source = _read(args.target), _read(args.source)
    parameters = IcpParameters(**chosen(args, MATCHING))
    result = icp(source, target, from_xytheta(args.initial), parameters)
    print(result_text(result))
    return 1 if result.termination.failed else 0


def _read(file: str) -> Scan:
    """Read the one scan in a file; a damaged row raises, oddities go to stderr."""
    log = read_log(file, strict=True)
    if log.format != "points" or len(log) != 1:
        raise LogError(f"{file}: expected one scan of points, rows `x,y` in metres, got {log}")
    for remark in log.remarks:
        print(f"note: {file}: {remark}", file=sys.stderr)
    return log.scans[0]


def result_text(result: IcpResult) -> str:
    """Format the motion, how the run ended, and how good the match is."""
    found = pose_text(to_xytheta(result.T_target_source)) + "\n"
    return (
        f"{'' if result.termination.failed else found}{result.message}\n"
        f"{result.iterations} iterations, {result.inlier_count} inliers "
        f"(fitness {result.fitness:.3f}), inlier RMSE {result.inlier_rmse:.4f} m, "
        f"cost {result.cost:.3g} m²"
    )
