"""``labkit info``: what a log holds and how it is read, before any matching."""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterator

import numpy as np

from labkit.cli.reading import add_log_options, read
from labkit.logs import Log
from labkit.support.arrays import FloatArray

DESCRIPTION = """\
Tell what a log holds and how it would be read: its parts, the scanner's beams, angles, ranges and
rate, the wheels, the scanner's place on the robot. Remarks tell what is odd. Nothing is matched."""
NOT_READ = "not read"


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``info`` to the command line."""
    about = "tell what a log holds and how it is read"
    parser = commands.add_parser("info", help=about, description=DESCRIPTION)
    parser.set_defaults(run=run)
    add_log_options(parser)


def run(args: argparse.Namespace) -> int:
    """Print what the log holds; remarks go to stderr."""
    log = read(args)
    for line in describe(log):
        print(line)
    if log.contents:
        print("the file holds")
    for part in log.contents:
        print(f"  {part.name:<28} {part.kind:<44} {part.use or NOT_READ}")
    return 0


def describe(log: Log) -> Iterator[str]:
    """Lines on the run, the scanner and the wheels."""
    yield f"run        {log.name}: {len(log)} scans, format {log.format}{_times(log)}"
    yield f"beams      {_beams(log)}"
    yield f"ranges     {_ranges(log)}"
    yield f"wheels     {_way(log.odometry)}"
    if log.reference is not None:
        yield f"reference  {_way(log.reference)}"
    place = "not told"
    if log.laser_offset is not None:
        x, y, theta = log.laser_offset
        place = f"({x:.4g}, {y:.4g}) m and {math.degrees(theta):.4g}° on the robot"
    yield f"scanner    {place}"


def _times(log: Log) -> str:
    stamps = log.stamps
    if np.isnan(stamps).any():
        return ", without times"
    steps = np.diff(stamps)
    rate = f", one each {np.median(steps):.4g} s" if len(steps) else ""
    return f"; {stamps[0]:.10g} to {stamps[-1]:.10g} s, {np.ptp(stamps):.4g} s in all{rate}"


def _beams(log: Log) -> str:
    """Number and directions of the beams, by the most usual scan."""
    geometries = Counter[tuple[int, float, float]]()
    for scan in log.scans:
        if scan.angles is not None:
            geometries[len(scan.angles), float(scan.angles[0]), float(scan.angles[-1])] += 1
    if not geometries:
        points = np.median([len(scan) for scan in log.scans])
        return f"none: points, {points:.0f} a scan"
    (count, first, last), _ = geometries.most_common(1)[0]
    others = f"; {len(geometries) - 1} other kinds of scans" if len(geometries) > 1 else ""
    step = f", each {math.degrees(last - first) / (count - 1):.4g}°" if count > 1 else ""
    beam_time = log.scans[0].time_increment
    skew = f"; {1e6 * beam_time:.4g} µs from beam to beam" if beam_time else ""
    ends = f"{math.degrees(first):.4g}° to {math.degrees(last):.4g}°"
    return f"{count} from {ends}{step}{skew}{others}"


def _ranges(log: Log) -> str:
    """The shortest and the longest range that makes a point, and how many beams return."""
    points = beams = 0
    shortest, longest = math.inf, 0.0
    for scan in log.scans:
        distances = np.hypot(*scan.points.T)
        points += len(distances)
        beams += len(distances) if scan.ranges is None else len(scan.ranges)
        shortest = min(shortest, distances.min(initial=math.inf))
        longest = max(longest, distances.max(initial=0.0))
    if points == 0:
        return "none makes a point"
    return f"{shortest:.4g} to {longest:.4g} m; {100.0 * points / beams:.3g} % of the beams return"


def _way(poses: FloatArray | None) -> str:
    """How far poses lead and turn."""
    if poses is None:
        return "none"
    steps = np.diff(poses, axis=0)
    told = np.isfinite(steps).all(axis=1)
    way = np.hypot(*steps[told, :2].T).sum()
    turn = np.abs((steps[told, 2] + math.pi) % (2.0 * math.pi) - math.pi).sum()
    silent = f"; silent at {np.count_nonzero(~told)} steps" if not told.all() else ""
    return f"{way:.4g} m and {math.degrees(turn):.4g}° of turns in all{silent}"
