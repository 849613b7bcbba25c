"""The lab's odometry beside scan matchers that people can install: same scans, wheels, reference.

``nice python tests/bench/rivals.py LOG... --repeats R --out FILE`` runs each odometry on each log
(`odometry_logs` tells how references and relations are found, and `corrected` makes belgioioso,
edmonton, fhw and seattle from public files), in an environment with
``tests/bench/requirements.txt``, and writes each result as a line of JSON when it is known. The
runs of one log differ by a millimetre of range noise, and share it. ``rivals.py --page FILE...``
writes ``book/rivals.md`` from the results.

Each is driven as its authors mean it, with the wheels as its guess. Their parameters are their
defaults but for those that stand here by name, chosen on csail and aces.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"  # this and the next before numpy loads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
import math
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import karto_scanmatcher
import numpy as np
from genz_icp.config import GenZConfig
from genz_icp.mapping import get_voxel_hash_map
from genz_icp.registration import get_registration
from genz_icp.threshold import get_threshold_estimator
from genz_icp.voxelization import voxel_down_sample
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP

from disturbances import BOOK, WRONG, Drive, ate_of, jittered, off
from labkit import Scan, from_xytheta, to_xytheta, transform
from labkit.odometry import estimate_odometry, integrate
from labkit.odometry.constants import KEY_MOTION
from labkit.se2 import apply, invert
from labkit.support.arrays import FloatArray
from labkit.support.warm import warm
from matchers.small_gicp_icp import gicp
from matchers.space import drop_transform, lift, lift_transform, wall
from odometry_logs import Reference, logs_in, wheels_of
from relations import read_relations, relation_errors
from tables import markdown

Estimator = Callable[[Sequence[Scan], FloatArray], FloatArray]

KARTO_SEARCH = (
    0.5,
    math.radians(35.0),
)  # [m], the whole side, and [rad]: its 0.3 m and 20° lose csail
KARTO_KEY_MOTION = (0.2, math.radians(10.0))  # [m], [rad]: its mapper's, as the next two
KARTO_KEY_SCANS = 70
KARTO_KEY_DISTANCE = 20.0  # [m] from the newest scan
KISS_VOXEL = 0.2  # [m]: rooms, where its own (a hundredth of the range) is made for streets
KISS_RANGE = 80.0  # [m]
GENZ_VOXEL = 0.2  # [m]: as KISS-ICP's
GICP_GATE = 0.5  # [m]
GICP_KEY_SCANS = 30


def wheels_alone(scans: Sequence[Scan], wheels: FloatArray) -> FloatArray:
    """What the wheels tell."""
    del scans
    return integrate(wheels)


def lab(scans: Sequence[Scan], wheels: FloatArray) -> FloatArray:
    """`estimate_odometry` with its defaults."""
    return estimate_odometry(scans, wheels).poses


def karto(scans: Sequence[Scan], wheels: FloatArray) -> FloatArray:
    """Karto's matcher against the last scans, as its mapper and slam_toolbox call it."""
    angles = scans[0].angles
    config = karto_scanmatcher.LaserScanConfig(
        angles[0], angles[-1], angles[1] - angles[0], 0.0, 80.0, 80.0, "laser"
    )
    parameters = karto_scanmatcher.ScanMatcherConfig()
    parameters.search_size, parameters.coarse_search_angle_offset = KARTO_SEARCH
    matcher = karto_scanmatcher.Wrapper(parameters)
    told = integrate(wheels)
    T_told = from_xytheta(told)
    T = np.eye(3)
    keys: deque[Any] = deque(maxlen=KARTO_KEY_SCANS)
    poses = []
    for k, scan in enumerate(scans):
        ranges = np.full(len(angles), 80.0)
        ranges[scan.beams] = scan.ranges[scan.beams]
        if k > 0:
            T = T @ invert(T_told[k - 1]) @ T_told[k]
        guess = karto_scanmatcher.Pose2(*to_xytheta(T))
        told_pose = karto_scanmatcher.Pose2(*told[k])
        sweep = karto_scanmatcher.LocalizedRangeScan(config, ranges, told_pose, guess, k, float(k))
        if keys:
            best = matcher.match_scan(sweep, list(keys), True, True).best_pose
            sweep.corrected_pose = best
            T = transform(best.x, best.y, best.yaw)
        poses.append(to_xytheta(T))
        if not keys or is_apart(poses_of(keys[-1]), T, KARTO_KEY_MOTION):
            keys.append(sweep)
            while np.hypot(*(poses_of(keys[0])[:2, 2] - T[:2, 2])) > KARTO_KEY_DISTANCE:
                keys.popleft()
    return np.array(poses)


def poses_of(sweep: Any) -> FloatArray:
    """The corrected pose of one of Karto's scans, (3, 3)."""
    pose = sweep.corrected_pose
    return transform(pose.x, pose.y, pose.yaw)


def kiss_icp(scans: Sequence[Scan], wheels: FloatArray) -> FloatArray:
    """KISS-ICP's pipeline, whose guess is the wheels' motion in place of the last one."""
    config = KISSConfig()
    config.data.max_range = KISS_RANGE
    config.data.deskew = False
    config.mapping.voxel_size = KISS_VOXEL
    config.registration.max_num_threads = 1
    pipeline = KissICP(config)
    motions = from_xytheta(np.vstack([np.zeros(3), wheels]))
    poses = []
    for scan, motion in zip(scans, motions, strict=True):
        pipeline.last_delta = lift_transform(motion)
        pipeline.register_frame(lift(scan.points), np.zeros(len(scan)))
        poses.append(to_xytheta(drop_transform(pipeline.last_pose)))
    return np.array(poses)


def genz_icp(scans: Sequence[Scan], wheels: FloatArray) -> FloatArray:
    """GenZ-ICP's registration and map as its pipeline calls them, from the wheels' guess."""
    config = GenZConfig()
    config.data.max_range = KISS_RANGE
    config.mapping.voxel_size = GENZ_VOXEL
    config.registration.max_num_threads = 1
    registration = get_registration(config)
    local_map = get_voxel_hash_map(config)
    threshold = get_threshold_estimator(config)
    motions = from_xytheta(np.vstack([np.zeros(3), wheels]))
    T = np.eye(4)
    poses = []
    for scan, motion in zip(scans, motions, strict=True):
        cloud = voxel_down_sample(wall(scan.points, GENZ_VOXEL), 0.5 * GENZ_VOXEL)
        T_guess = T @ lift_transform(motion)
        T = T_guess
        if not local_map.empty():
            sigma = threshold.get_threshold()
            source = voxel_down_sample(cloud, GENZ_VOXEL)
            with silence():
                T = registration.align_points_to_map(
                    source, local_map, T_guess, 3.0 * sigma, sigma / 3.0
                )
        threshold.update_model_deviation(np.linalg.inv(T_guess) @ T)
        local_map.update(cloud, T)
        poses.append(to_xytheta(drop_transform(T)))
    return np.array(poses)


@contextmanager
def silence() -> Iterator[None]:
    """Send what C++ prints nowhere."""
    kept = os.dup(1)
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)


def small_gicp(scans: Sequence[Scan], wheels: FloatArray) -> FloatArray:
    """small_gicp's generalised ICP against the last key scans, chosen as the lab chooses them."""
    motions = from_xytheta(np.vstack([np.zeros(3), wheels]))
    T = np.eye(3)
    T_key = np.eye(3)
    keys: deque[FloatArray] = deque(maxlen=GICP_KEY_SCANS)
    poses = []
    for scan, motion in zip(scans, motions, strict=True):
        T = T @ motion
        if keys:
            T = gicp(scan.points, np.vstack(keys), T, GICP_GATE)[0]
        poses.append(to_xytheta(T))
        if not keys or is_apart(T_key, T, KEY_MOTION):
            keys.append(apply(T, scan.points))
            T_key = T
    return np.array(poses)


def is_apart(T_a: FloatArray, T_b: FloatArray, motion: tuple[float, float]) -> bool:
    """True if two poses lie farther apart than a motion, [m] and [rad]."""
    x, y, turn = to_xytheta(invert(T_a) @ T_b)
    return math.hypot(x, y) > motion[0] or abs(turn) > motion[1]


RIVALS: dict[str, Estimator] = {
    "wheels alone": wheels_alone,
    "labkit": lab,
    "Karto": karto,
    "KISS-ICP": kiss_icp,
    "GenZ-ICP": genz_icp,
    "small_gicp": small_gicp,
}


def drive_of(name: str) -> tuple[Drive, Path | None, FloatArray]:
    """A log's scans, wheels and true poses, NaN without a reference; its relations; its stamps."""
    log, reference, relations = logs_in([name])[0]
    reference = reference or Reference(scans=np.arange(0), poses=np.empty((0, 3)))
    truth = np.full((len(log), 3), np.nan)
    truth[reference.scans] = reference.poses
    return Drive(list(log.scans), wheels_of(log), truth), relations, log.stamps


def measure(path: str, rival: str, seed: int) -> dict[str, Any]:
    """One run: its error against the reference [m], or the median one of surveyed relations."""
    drive, relations, stamps = drive_of(path)
    drive = jittered(drive, seed)
    began = time.process_time()
    poses = RIVALS[rival](drive.scans, drive.wheels)
    seconds = time.process_time() - began
    result = {"log": Path(path).name.partition(".")[0], "rival": rival, "seed": seed}
    if np.isfinite(drive.truth).any():
        result["ate"] = ate_of(poses, drive.truth)
        result["wrong"] = int(off(poses, drive.truth, WRONG).sum())
    elif relations is not None:
        errors, pairs = relation_errors(read_relations(relations), poses, stamps)
        apart = np.diff(pairs)[:, 0] > 1
        result["far"] = float(np.median(errors.translation_errors[apart]))
    return {**result, "steps": len(drive.wheels), "ms": 1e3 * seconds / len(drive.scans)}


COLUMNS = ("log", "odometry", "error m", "smallest", "largest", "wrong", "ms a step", "runs")


def page(results: list[dict[str, Any]]) -> str:
    """The page of the book: a row for each odometry on each log."""
    rows = []
    for log in dict.fromkeys(result["log"] for result in results):
        for rival in RIVALS:
            runs = [run for run in results if (run["log"], run["rival"]) == (log, rival)]
            if runs:
                rows.append([log, *row_of(rival, runs)])
    return f"{INTRO}\n\n{markdown(COLUMNS, rows)}\n"


def row_of(rival: str, runs: list[dict[str, Any]]) -> list[str]:
    """Error [m] and its range, median of wrong steps, the time of a step, and how many runs."""
    errors = [run.get("ate", run.get("far")) for run in runs]
    figures = [f"{error:.2f}" for error in (np.median(errors), min(errors), max(errors))]
    wrong = f"{np.median([run['wrong'] for run in runs]):.0f}" if "wrong" in runs[0] else "–"
    milliseconds = f"{np.median([run['ms'] for run in runs]):.1f}"
    return [rival, *figures, wrong, milliseconds, str(len(runs))]


INTRO = """\
# Rivals

How good is the [lab's odometry](odometry.md) beside scan matchers that anybody can install? Each
gets the same scans, the same wheels as its guess, and the same reference. The error is ATE in
metres; on intel, which has no reference, it is the median error of surveyed relations between scans
that do not follow one another. It is the median of some runs, whose ranges differ by a millimetre
of noise, beside the smallest and the largest one. A step is *wrong* if it is off by more than 0.2 m
or 5°; that is a median, too. Some steps of the references are wrong themselves: six of csail's. The
time is processor time of a step on a busy machine: compare it within a log only. Rows of other
numbers of runs are of other days.

- **Karto**: the matcher of OpenKarto, from `karto-scanmatcher`, on which slam_toolbox is built,
  against the last 70 key scans within 20 m, as its mapper calls it. It searches 0.5 m and 35° wide:
  within its own 0.3 m and 20° it loses csail. In cells of 2 cm, not 1 cm, and 0.8 m wide it errs by
  0.20 m on csail and 0.95 m on aces.
- **KISS-ICP**: its pipeline with voxels of 0.2 m, the best of four sizes on csail.
- **GenZ-ICP**: its registration against its map, with voxels of 0.2 m, from the wheels' guess: its
  own pipeline takes none. Walls stand upright, two points high, since a flat scan is one plane.
- **small_gicp**: generalised ICP against the last 30 key scans, chosen by the lab's rule, with a
  gate of 0.5 m.

Belgioioso, edmonton, fhw and seattle are made by `tests/bench/corrected.py` from the public logs of
acschaefer/ple, with the poses of GMapping as reference.

`tests/bench/rivals.py` writes this page; its parameters stand there."""


def main() -> int:
    """Run and print; or write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="*", metavar="LOG")
    parser.add_argument("--only", nargs="+", choices=RIVALS, default=list(RIVALS))
    parser.add_argument("--repeats", type=int, default=1, metavar="R", help="with other seeds")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the results, JSON lines")
    parser.add_argument("--page", nargs="+", type=Path, metavar="FILE", help="results to write up")
    args = parser.parse_args()
    if args.page:
        lines = [line for path in args.page for line in path.read_text("utf-8").splitlines()]
        text = page([json.loads(line) for line in lines])
        (BOOK / "rivals.md").write_text(text, encoding="utf-8")
        return 0
    warm()
    with open(args.out or os.devnull, "a", encoding="utf-8") as out:
        for seed in range(args.repeats):
            for path in args.logs:
                for rival in args.only:
                    result = measure(path, rival, seed)
                    print(*(f"{n:.2f}" if isinstance(n, float) else n for n in result.values()))
                    print(json.dumps(result), file=out, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
