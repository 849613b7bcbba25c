"""Drive's rays, wheels and odometry, as the page computes them, against labkit's."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

pytest.importorskip("anywidget")

from in_node import told_by

import labkit
from labkit.interactive.driving import PLACES, WHEELS, Drive, drive
from labkit.parameters import ACCURATE
from labkit.simulation import Lidar, WheelNoise, cast, wheel_increments

CLOSE = 1e-9  # m and rad
QUIET = Lidar(beam_count=181, noise_std=0.0)


def driven(folder: Any, lidar: Lidar, tracks: dict[str, Any], steps: Any = (), **told: Any) -> Any:
    """What the page makes of a track through each of the named places, from Drive's own module."""
    widget = drive()
    segments = {each["name"]: each["segments"] for each in widget.places}
    jobs = [
        {"segments": segments[name], "poses": poses, "parameters": widget.parameters} | told
        for name, poses in tracks.items()
    ]
    scanner = asdict(lidar) | {"angles": lidar.angles.tolist()}
    return told_by(
        "drive.mjs", Drive._esm, {"lidar": scanner, "drives": jobs, "steps": steps}, folder
    )


def tracks() -> dict[str, Any]:
    """A track from the start of each place: random, but off the walls."""
    rng = np.random.default_rng(5)
    ways = {}
    for name, (_, start, *_words) in PLACES.items():
        wander = np.cumsum(rng.normal(0.0, [0.02, 0.01, 0.06], (40, 3)), axis=0)
        wander[:, 0] += 0.01 * np.arange(40) * np.cos(start[2])
        ways[name] = np.round(np.array(start) + wander, 3).tolist()
    return ways


def test_rays_are_the_simulator_s_and_steps_are_labkit_s(tmp_path):
    """In each world, beam by beam; and each match of two of the page's own scans, with noise."""
    quiet = driven(tmp_path, QUIET, tracks())["answers"]
    noisy = driven(tmp_path, Lidar(beam_count=181, noise_std=0.03), tracks())["answers"]
    for place, poses, told, drifted in zip(
        PLACES.values(), tracks().values(), quiet, noisy, strict=True
    ):
        for pose, ranges in zip(poses, told["ranges"], strict=True):
            seen = cast(place[0], labkit.from_xytheta(pose), QUIET, rng=0)
            expected = np.where(np.isfinite(seen.ranges), seen.ranges, np.nan)
            np.testing.assert_allclose(np.array(ranges, float), expected, rtol=0, atol=CLOSE)
        ranges = np.array(drifted["ranges"], float)
        scans = [
            labkit.Scan.from_ranges(np.nan_to_num(r, nan=np.inf), QUIET.angles) for r in ranges
        ]
        T = labkit.from_xytheta(poses[0])
        for older, newer, believed in zip(scans, scans[1:], drifted["before"][1:], strict=False):
            run = labkit.icp(newer, labkit.Target(older), parameters=ACCURATE)
            T = T if run.termination.failed else T @ run.T_target_source
            off = labkit.to_xytheta(labkit.se2.relative(T, labkit.from_xytheta(believed)))
            assert abs(off).max() < CLOSE * len(scans)


def test_a_recognised_place_takes_most_of_the_error_away(tmp_path):
    turn = np.linspace(0.0, 4.5 * np.pi, 170)  # a second round, and a little more
    x, y = 2.9 * np.cos(turn), 2.0 * np.sin(turn)
    ahead = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    poses = np.round(np.column_stack([x, y, ahead]), 3).tolist()
    (told,) = driven(tmp_path, Lidar(beam_count=181, noise_std=0.03), {"Room": poses})["answers"]
    before, after = (np.array(told[when])[:, :2] for when in ("before", "after"))
    off = [np.hypot(*(each - np.array(poses)[:, :2]).T).max() for each in (before, after)]
    assert told["recognised"] > 5
    assert off[1] < 0.6 * off[0]
    assert np.allclose(told["again"], poses, rtol=0, atol=1e-9)  # what a link holds is the drive


def test_a_link_can_only_hold_what_the_robot_can_drive(tmp_path):
    step, turn = 2.5 * 0.2, 1.7 * 0.2  # at full speed, from one scan to the next
    tracks = [[step, 0.0, 0.0], [0.0, 0.0, turn], [1.5 * step, 0.0, 0.0], [0.0, 0.0, 1.5 * turn]]

    told = [
        driven(tmp_path, QUIET, {"Corridor": [[0.0, 0.0, 0.0], pose]})["answers"][0]["isDriven"]
        for pose in tracks
    ]

    assert told == [True, True, False, False]


def test_wheels_err_as_the_simulator_s_do(tmp_path):
    steps = [[0.3, -0.1, 0.2], [0.0, 0.0, 0.4], [0.5, 0.0, 0.0]]
    noises = [*WHEELS.values(), WheelNoise(along=0.0, across=0.0, turn=0.0, drift=0.0)]
    asked = [{"step": step, "noise": asdict(noise)} for step in steps for noise in noises]
    told = driven(tmp_path, QUIET, {}, asked)["told"]
    for each, found in zip(asked, told, strict=True):
        poses = np.zeros((2, 3))
        poses[1] = each["step"]
        rng = np.random.default_rng(0)
        noise = WheelNoise(**each["noise"])
        drawn = np.array([wheel_increments(poses, noise, rng=rng)[0] for _ in range(4000)])
        assert np.allclose(np.mean(found, axis=0), drawn.mean(axis=0), atol=4e-3)
        assert np.allclose(np.std(found, axis=0), drawn.std(axis=0), rtol=0.1, atol=1e-12)
