"""The search: what it finds, what it costs nothing to try, and where it says that it cannot."""

import math
from itertools import combinations

import numpy as np
import pytest

from labkit import Scan, Target
from labkit.odometry.search import (
    CELL,
    MAX_RANGE,
    LikelihoodField,
    is_same_pose,
    mean_values,
    search,
)
from labkit.se2 import apply, from_xytheta, relative, to_xytheta
from labkit.simulation import Lidar, cast, room

STILL = np.zeros(3)
LIDAR = Lidar(beam_count=181, field_of_view=math.pi)
WINDOW = 2.0, math.radians(90.0)
MOTIONS = [(0.9, 0.3, 60.0), (-0.8, 0.0, -60.0), (0.0, -1.5, 85.0), (1.7, 0.4, 10.0)]


def looks(motion, world=None, rng=0):
    rng = np.random.default_rng(rng)
    poses = from_xytheta([STILL, motion])
    older, newer = (cast(world or room(), T, LIDAR, rng=rng) for T in poses)
    return newer, older


def degrees(motion):
    x, y, turn = motion
    return np.array([x, y, math.radians(turn)])


@pytest.mark.parametrize("motion", [degrees(motion) for motion in MOTIONS])
def test_a_step_without_a_guess_is_found_from_one_of_its_starts(motion):
    newer, older = looks(motion)
    starts = search(newer, Target(older), np.eye(3), WINDOW)[:4]
    errors = to_xytheta(relative(from_xytheta(motion), starts))
    near = (np.hypot(errors[:, 0], errors[:, 1]) < 0.2) & (np.abs(errors[:, 2]) < 0.06)
    assert near.any()
    assert not any(is_same_pose(*each) for each in combinations(starts, 2))


def test_it_stays_within_its_window():
    newer, older = looks(degrees((1.5, 0.0, 0.0)))
    starts = search(newer, Target(older), np.eye(3), (0.5, 0.2))[:3]
    x, y, turn = np.abs(to_xytheta(starts)).T
    assert max(x.max(), y.max()) <= 0.5 + 0.5
    assert turn.max() <= 0.2 + math.radians(3.0)


@pytest.mark.parametrize("shift", [9.0, 15.0])
def test_a_lost_robot_is_not_looked_for_farther_off_than_a_search_pays(shift):
    target = Target(Scan.from_points([[0.0, 0.0]]))
    starts = search(Scan.from_points([[shift, 0.0]]), target, np.eye(3), (1e3, 0.0))
    assert np.abs(to_xytheta(starts)[:, :2]).max() < 0.5 * MAX_RANGE + 0.5
    assert is_same_pose(starts[0], from_xytheta([-shift, 0.0, 0.0])) == (shift < 0.5 * MAX_RANGE)


def test_mean_values_are_those_of_the_table():
    """Against numpy; a cell beyond the table counts as the nearest one on its border."""
    rng = np.random.default_rng(0)
    table, points = rng.random((20, 30)), rng.uniform(-1.0, 4.0, (17, 2))
    poses, corner = from_xytheta(rng.uniform(-1.0, 1.0, (4, 3))), np.array([-0.5, 0.3])
    shifts = rng.integers(-6, 7, (5, 2))
    cells = np.floor((apply(poses[2], points) - corner) / CELL).astype(int)
    row, column = np.clip(cells + shifts[3], 0, [19, 29]).T

    means = mean_values(table, corner, points, poses, shifts)

    assert means[2, 3] == pytest.approx(table[row, column].mean(), rel=1e-13)


def test_the_field_is_the_distance_to_the_nearest_point():
    """One point of the source on a point of the target, and one half a metre off."""
    target = Target(Scan.from_points([[0.05, 0.05], [3.05, 2.05]]))
    field = LikelihoodField.of(target.points)
    source = Scan.from_points([[3.05, 2.05]])
    start = search(source, target, np.eye(3), (0.0, 0.0))[0]
    assert is_same_pose(start, np.eye(3))
    there, off = np.floor((np.array([[3.05, 2.05], [3.05, 1.75]]) - field.corner) / CELL).astype(
        int
    )
    assert field.fine[*there] == 1.0
    assert field.fine[*off] == pytest.approx(math.exp(-0.5 * (0.3 / CELL) ** 2))


def test_a_scan_without_points_has_no_start():
    target = Target(Scan.from_points([[1.0, 0.0]]))
    far_off = Scan.from_points([[500.0, 0.0]])
    assert search(far_off, target, np.eye(3), WINDOW) == []


def test_a_coarse_cell_promises_at_least_what_it_stands_for():
    field = LikelihoodField.of(looks(STILL)[1].points)
    for i in (-2, 0, 2):
        for j in (-2, 0, 2):
            around = np.roll(field.fine, (i, j), axis=(0, 1))[5:-5, 5:-5]
            assert (field.coarse[5:-5, 5:-5] >= around).all()
