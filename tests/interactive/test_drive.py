"""Drive's rays, wheels and odometry, as the page computes them, against labkit's."""

from __future__ import annotations

import math
from dataclasses import asdict
from itertools import product

import numpy as np
import pytest

pytest.importorskip("anywidget")

import labkit
from labkit.interactive.driving import PLACES, WHEELS, Drive, drive
from labkit.parameters import ACCURATE
from labkit.simulation import Lidar, WheelNoise, cast, wheel_increments
from tests.interactive.in_node import run_in_node

TOLERANCE = 1e-9  # [m] and [rad]
COUNT = 1000  # steps that are drawn: their spread is known to 2.2 %
WITHOUT_NOISE = Lidar(beam_count=181, noise_std=0.0)
WITH_NOISE = Lidar(beam_count=181, noise_std=0.03)
MUCH_NOISE = Lidar(beam_count=181, noise_std=0.06)  # so much that two rounds drift
NO_WHEEL_NOISE = WheelNoise(along=0.0, across=0.0, turn=0.0, drift=0.0)
ERRORS = [[0.11, 0.0], [0.0, math.radians(5.1)], [0.09, math.radians(4.9)]]  # [m], [rad]
WALLS = [[2.0, -1.0, 2.0, 1.0], [2.0, 0.5, 2.0, 3.0], [2.0, -3.0, 2.0, -0.5]]  # [m]
SPEED, TURN_RATE, SCAN_PERIOD = 2.5, 1.7, 0.2  # [m/s], [rad/s], [s] of the robot
ROBOT_RADIUS = 0.28  # [m]


@pytest.fixture(scope="module")
def run_drive(tmp_path_factory):
    """A function that lets the page drive tracks (name of place, poses), and draw wheels' steps."""
    folder = tmp_path_factory.mktemp("drive")
    widget = drive()
    segments = {place["name"]: place["segments"] for place in widget.places}

    def run(lidar, tracks, wheel_steps=()):
        job = {
            "lidar": asdict(lidar) | {"angles": lidar.angles.tolist()},
            "drives": [
                {"segments": segments[name], "poses": poses, "parameters": widget.parameters}
                for name, poses in tracks
            ],
            "steps": list(wheel_steps),
            "count": COUNT,
            "errors": ERRORS,
            "walls": WALLS,
        }
        return run_in_node("drive.mjs", Drive._esm, job, folder)

    return run


def track_through(name):
    """A track from the start of a place: random, but off the walls."""
    rng = np.random.default_rng(5)
    start = np.array(PLACES[name][1])
    motion = np.cumsum(rng.normal(0.0, [0.02, 0.01, 0.06], (40, 3)), axis=0)
    motion[:, 0] += 0.01 * np.arange(40) * np.cos(start[2])
    return np.round(start + motion, 3).tolist()


def as_ranges(answer):
    """Ranges of each scan of an answer [m], infinite where nothing returned."""
    return np.nan_to_num(np.array(answer["ranges"], float), nan=np.inf)


@pytest.fixture(scope="module")
def answers(run_drive):
    """What the page makes of the tracks through all places, by the noise of the scanner."""
    tracks = [(name, track_through(name)) for name in PLACES]
    return {
        lidar: dict(zip(PLACES, run_drive(lidar, tracks)["answers"], strict=True))
        for lidar in (WITHOUT_NOISE, WITH_NOISE)
    }


@pytest.mark.parametrize("name", PLACES)
def test_rays_are_the_simulator_s(answers, name):
    """In each world, beam by beam."""
    world = PLACES[name][0]
    T_world_scanner = labkit.from_xytheta(track_through(name))

    ranges = as_ranges(answers[WITHOUT_NOISE][name])

    for T, scan_ranges in zip(T_world_scanner, ranges, strict=True):
        expected = cast(world, T, WITHOUT_NOISE, rng=0).ranges
        np.testing.assert_allclose(scan_ranges, expected, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("name", PLACES)
def test_poses_are_labkit_s_matches_of_the_page_s_scans(answers, name):
    answer = answers[WITH_NOISE][name]
    scans = [labkit.Scan.from_ranges(row, WITH_NOISE.angles) for row in as_ranges(answer)]

    T = labkit.from_xytheta(track_through(name)[0])
    for target, source, pose in zip(scans, scans[1:], answer["before"][1:], strict=False):
        result = labkit.icp(source, labkit.Target(target), parameters=ACCURATE)
        T = T if result.termination.failed else T @ result.T_target_source
        difference = labkit.to_xytheta(labkit.se2.relative(T, labkit.from_xytheta(pose)))
        np.testing.assert_allclose(difference, 0.0, atol=TOLERANCE * len(scans))


@pytest.fixture(scope="module")
def two_rounds(run_drive):
    """A track of two rounds about the pillar, and a little more, and what the page makes of it."""
    turn = np.linspace(0.0, 4.5 * np.pi, 170)
    x, y = 2.9 * np.cos(turn), 2.0 * np.sin(turn)
    heading = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    poses = np.round(np.column_stack([x, y, heading]), 3)
    (answer,) = run_drive(MUCH_NOISE, [("Room", poses.tolist())])["answers"]
    return poses, answer


def test_a_recognised_place_takes_most_of_the_error_away(two_rounds):
    poses, answer = two_rounds
    error_before, error_after = (
        np.hypot(*(np.array(answer[name]) - poses)[:, :2].T).max() for name in ("before", "after")
    )

    assert answer["recognised"] > 5
    assert error_after < 0.6 * error_before


def test_a_link_holds_the_whole_drive(two_rounds):
    poses, answer = two_rounds
    np.testing.assert_allclose(answer["again"], poses, rtol=0, atol=1e-9)


def test_a_link_can_only_hold_what_the_robot_can_drive(run_drive):
    step, turn = SPEED * SCAN_PERIOD, TURN_RATE * SCAN_PERIOD
    poses = [[step, 0.0, 0.0], [0.0, 0.0, turn], [1.5 * step, 0.0, 0.0], [0.0, 0.0, 1.5 * turn]]
    tracks = [("Corridor", [[0.0, 0.0, 0.0], pose]) for pose in poses]

    answers = run_drive(WITHOUT_NOISE, tracks)["answers"]

    assert [answer["isDriven"] for answer in answers] == [True, True, False, False]


def test_what_a_recognised_place_gains_is_said(run_drive):
    nothing_seen, nothing_gained, better, worse = run_drive(WITHOUT_NOISE, [])["closings"]

    assert "no place" in nothing_seen
    assert nothing_gained == "1 scan recognised, and nothing gained: still 10.52 m off."
    assert better == "3 scans recognised: 2.00 m off before, 0.50 m now."
    assert worse.startswith("2 scans recognised, and the drive is worse: 0.50 m off before")


def test_a_step_is_wrong_beyond_ten_centimetres_or_five_degrees(run_drive):
    assert run_drive(WITHOUT_NOISE, [])["wrong"] == [True, True, False]


def test_a_wall_stops_the_robot_and_ends_where_it_ends(run_drive):
    """Along x, across whose way the first wall stands; the others stand beside it."""
    at_wall, *beside_walls = run_drive(WITHOUT_NOISE, [])["reached"]

    assert at_wall == pytest.approx([2.0 - ROBOT_RADIUS, 0.0, 0.0], abs=1e-6)
    assert min(x for x, _, _ in beside_walls) > 4.0


def test_wheels_err_as_the_simulator_s_do(run_drive):
    steps = [[0.3, -0.1, 0.2], [0.0, 0.0, 0.4], [0.5, 0.0, 0.0]]
    cases = list(product(steps, [*WHEELS.values(), NO_WHEEL_NOISE]))
    jobs = [{"step": step, "noise": asdict(noise)} for step, noise in cases]

    samples = run_drive(WITHOUT_NOISE, [], jobs)["drawn"]

    for (step, noise), drawn in zip(cases, samples, strict=True):
        there_and_back = np.tile([[0.0, 0.0, 0.0], step], (COUNT, 1))
        expected = wheel_increments(there_and_back, noise, rng=0)[::2]
        spread = expected.std(axis=0)
        error_of_mean = np.abs(np.mean(drawn, axis=0) - expected.mean(axis=0))
        assert (error_of_mean <= 4.0 * spread * np.sqrt(2.0 / COUNT) + 1e-12).all()
        np.testing.assert_allclose(np.std(drawn, axis=0), spread, rtol=0.1, atol=1e-12)
