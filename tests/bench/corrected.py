"""Logs of a mapper with their wheels: the ``NAME-corrected.log.gz`` of github.com/acschaefer/ple.

``python tests/bench/corrected.py FOLDER FILE...`` writes ``NAME.log.gz``, whose poses are those of
the wheels, and ``NAME.ref.tum.gz``, the poses of the mapper, into a folder; `odometry_logs` and
what stands on it read both. The mapper wrote a FLASER line for each of its scans, with the
corrected pose, and the same pose as ODOM. The ODOM lines until the next scan go on from there by
the wheels.
"""

from __future__ import annotations

import gzip
import sys
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from labkit import from_xytheta, to_xytheta, wrap
from labkit.logs import write_tum
from labkit.se2 import relative
from labkit.support.arrays import FloatArray

INTERVAL = 0.2  # [s]: stated, as the files have lost their stamps


class CorrectedScan(NamedTuple):
    """A scan of the mapper."""

    ranges: list[str]
    corrected: FloatArray  # (3,)
    by_wheels: FloatArray  # (3,): where the wheels led from the corrected pose before


def read_corrected(path: Path) -> list[CorrectedScan]:
    """The scans of a file."""
    scans = []
    by_wheels = None
    is_repeated = False  # the ODOM line after a scan
    for line in gzip.decompress(path.read_bytes()).decode("utf-8", "replace").splitlines():
        word, *fields = line.split() or [""]
        if word == "ODOM" and not is_repeated:
            by_wheels = pose_of(fields)
        is_repeated = word == "FLASER" and fields[0].isdigit()
        if is_repeated:
            count = int(fields[0])
            corrected = pose_of(fields[count + 1 :])
            moved = corrected if by_wheels is None else by_wheels
            scans.append(CorrectedScan(fields[1 : count + 1], corrected, moved))
            by_wheels = corrected
    return scans


def pose_of(fields: list[str]) -> FloatArray:
    """The pose (3,) with which some fields begin."""
    x, y, heading = map(float, fields[:3])
    return np.array([x, y, wrap(heading)])


def chain_wheels(scans: list[CorrectedScan]) -> FloatArray:
    """The poses (K, 3) to which the wheels alone lead from the first one."""
    T = from_xytheta(scans[0].corrected)
    poses = [to_xytheta(T)]
    for before, scan in pairwise(scans):
        T = T @ relative(from_xytheta(before.corrected), from_xytheta(scan.by_wheels))
        poses.append(to_xytheta(T))
    return np.array(poses)


def main(folder: str, *files: str) -> None:
    """Write the logs of some files into a folder."""
    for file in map(Path, files):
        scans = read_corrected(file)
        stamps = INTERVAL * np.arange(len(scans))
        stem = Path(folder) / file.name.partition("-corrected")[0]
        with gzip.open(f"{stem}.log.gz", "wt", encoding="utf-8") as log:
            for scan, stamp, pose in zip(scans, stamps, chain_wheels(scans), strict=True):
                words = " ".join(f"{value:.6f}" for value in pose)
                ranges = " ".join([str(len(scan.ranges)), *scan.ranges])
                log.write(f"FLASER {ranges} {words} {words} {stamp:.6f} robot {stamp:.6f}\n")
        write_tum(f"{stem}.ref.tum.gz", stamps, np.array([scan.corrected for scan in scans]))


if __name__ == "__main__":
    main(*sys.argv[1:])
