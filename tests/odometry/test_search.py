"""The search: what it finds, what it costs nothing to try, and where it says that it cannot."""

import math
from itertools import combinations

import numpy as np
import pytest

from labkit import Scan, Target
from labkit.odometry import Decision, OdometryParameters, estimate_step
from labkit.odometry.agreement import CLEARANCE, beams_of, seen_through
from labkit.odometry.search import CELL, LikelihoodField, alike, mean_values, search
from labkit.odometry.step import ALIKE
from labkit.se2 import apply, from_xytheta, relative, to_xytheta
from labkit.simulation import Lidar, cast, corridor, room

STILL = np.zeros(3)
LIDAR = Lidar(beam_count=181, field_of_view=math.pi)
WINDOW = 2.0, math.radians(90.0)
MOTIONS = [(0.9, 0.3, 60.0), (-0.8, 0.0, -60.0), (0.0, -1.5, 85.0), (1.7, 0.4, 10.0)]
PARAMETERS = OdometryParameters()


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
    assert not any(alike(*each) for each in combinations(starts, 2))
    record = estimate_step(newer, Target(older), None, STILL, PARAMETERS)
    assert record.decision is Decision.SEARCH
    np.testing.assert_allclose(record.increment, motion, atol=0.02)
    assert record.seen_through < 0.05
    assert not record.ambiguous


def test_it_stays_within_its_window():
    newer, older = looks(degrees((1.5, 0.0, 0.0)))
    starts = search(newer, Target(older), np.eye(3), (0.5, 0.2))[:3]
    x, y, turn = np.abs(to_xytheta(starts)).T
    assert max(x.max(), y.max()) <= 0.5 + 0.5
    assert turn.max() <= 0.2 + math.radians(3.0)


def test_mean_values_are_those_of_the_table():
    """Against numpy; a cell beyond the table counts as the nearest one on its border."""
    rng = np.random.default_rng(0)
    table, cells = rng.random((20, 30)), rng.integers(-5, 35, (4, 17, 2))
    shifts = rng.integers(-6, 7, (5, 2))
    row, column = np.clip(cells[2] + shifts[3], 0, [19, 29]).T
    means = mean_values(table, cells, shifts)
    assert means[2, 3] == pytest.approx(table[row, column].mean(), rel=1e-13)


def test_the_field_is_the_distance_to_the_nearest_point():
    """One point of the source on a point of the target, and one half a metre off."""
    target = Target(Scan.from_points([[0.05, 0.05], [3.05, 2.05]]))
    field = LikelihoodField.of(target.points)
    source = Scan.from_points([[3.05, 2.05]])
    start = search(source, target, np.eye(3), (0.0, 0.0))[0]
    assert alike(start, np.eye(3))
    there, off = field.cells(np.array([[3.05, 2.05], [3.05, 1.75]])).tolist()
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


def test_beams_look_through_a_wall_that_is_not_there():
    wall = np.column_stack([np.full(41, 4.0), np.linspace(-1.0, 1.0, 41)])
    curtain = wall * [0.5, 0.4]
    beams = beams_of(Scan.from_points(wall))
    assert seen_through(*beams, wall, np.eye(3)) == 0.0
    assert seen_through(*beams, curtain, np.eye(3)) == 1.0
    both = np.vstack([wall, curtain])
    assert seen_through(*beams, both, np.eye(3)) == pytest.approx(0.5, abs=0.02)
    hidden = apply(from_xytheta([9.0, 0.0, 0.0]), wall)
    assert math.isnan(seen_through(*beams, hidden, np.eye(3)))
    assert math.isnan(seen_through(*beams, -wall, np.eye(3)))  # behind the scanner
    back = from_xytheta([-2.0 * CLEARANCE, 0.0, 0.0])
    assert seen_through(*beams, apply(back, wall), back) == 0.0  # the wall moved along
    assert seen_through(*beams, apply(back, wall), np.eye(3)) > 0.9


def test_a_good_match_is_not_searched_for(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("searched")

    monkeypatch.setattr("labkit.odometry.step.search", refuse)
    newer, older = looks(degrees((0.2, 0.0, 5.0)))
    for prior in (STILL, None):
        record = estimate_step(newer, Target(older), prior, STILL, PARAMETERS)
        assert record.decision is Decision.ICP
        assert math.isnan(record.margin)
    with pytest.raises(AssertionError, match="searched"):
        estimate_step(newer, Target(older), None, degrees((0.0, 0.0, 80.0)), PARAMETERS)


def test_along_a_corridor_the_robot_goes_on_as_before():
    """All places along it look alike. What the walls tell is taken from them: here, the turn."""
    motion = degrees((0.9, 0.1, 10.0))
    newer, older = looks(motion, corridor(), rng=1)
    before = np.array([degrees((0.05, 0.0, 30.0)), degrees((0.8, 0.0, 2.0))])
    record = estimate_step(newer, Target(older), None, before, PARAMETERS)
    assert record.degenerate
    assert record.decision.matched
    np.testing.assert_allclose(record.increment[[1, 2]], motion[[1, 2]], atol=0.03)
    assert record.increment[0] == pytest.approx(0.8, abs=0.05)
    still = estimate_step(newer, Target(older), None, STILL, PARAMETERS)
    assert still.increment[0] == pytest.approx(0.0, abs=0.05)


def colonnade(places, reach):
    """Two walls as long as `reach` to either side, and pillars along one of them."""
    x = np.arange(-reach, reach, 0.05)
    walls = [np.column_stack([x, np.full(len(x), y)]) for y in (-1.5, 1.5)]
    pillars = [np.column_stack([np.full(8, x), np.linspace(1.0, 1.45, 8)]) for x in places]
    return np.vstack([*walls, *pillars])


@pytest.mark.parametrize("driven", [0.9, 0.1])
def test_a_small_mark_in_a_corridor_tells_which_of_the_last_motions_goes_on(driven):
    """It says too little to measure the way by, but enough to choose between two."""
    target = Target(Scan.from_points(colonnade([1.0], 6.0)))
    source = Scan.from_points(colonnade([1.0 - driven], 5.0))
    before = np.array([[0.1, 0.0, 0.0], [0.9, 0.0, 0.0]])
    record = estimate_step(source, target, None, before, PARAMETERS)
    assert record.degenerate
    np.testing.assert_allclose(record.increment, [driven, 0.0, 0.0], atol=0.02)


def test_what_fits_in_several_places_is_no_measurement(monkeypatch):
    for name in ("SUPPORTED", "SURE"):  # search for every step
        monkeypatch.setattr(f"labkit.odometry.step.{name}", 1.0)
    pillars = np.arange(-4.8, 4.9, 0.4)
    target = Target(Scan.from_points(colonnade(pillars, 5.0)))
    exact = colonnade(pillars[4:-4], 3.5)
    source = Scan.from_points(exact + np.random.default_rng(0).normal(0.0, 2e-3, exact.shape))
    between = np.array([0.2, 0.0, 0.0])
    record = estimate_step(source, target, between, STILL, PARAMETERS)
    assert record.ambiguous
    assert -ALIKE < record.margin < ALIKE
    assert record.decision is Decision.PRIOR
    np.testing.assert_array_equal(record.increment, between)
    assert "ambiguous" in record.reason
    # Without wheels, the place that is nearest to the expected one.
    alone = estimate_step(source, target, None, np.array([0.3, 0.0, 0.0]), PARAMETERS)
    assert alone.ambiguous
    np.testing.assert_allclose(alone.increment, [0.4, 0.0, 0.0], atol=0.02)
    target = Target(Scan.from_points(colonnade([-4.4, -1.2, 0.0, 2.0], 5.0)))
    source = Scan.from_points(colonnade([-1.2, 0.0, 2.0], 3.5))
    one_place = estimate_step(source, target, between, STILL, PARAMETERS)
    assert not one_place.ambiguous
    np.testing.assert_allclose(one_place.increment, STILL, atol=0.02)


@pytest.mark.parametrize("ahead", [0.25, 0.8])
def test_a_few_pillars_tell_more_than_the_last_motion(ahead):
    """Pairs alone leave the way along open. Where the scan fits clearly better, it is taken."""
    target = Target(Scan.from_points(colonnade([-4.4, -1.2, 0.0, 2.0], 5.0)))
    source = Scan.from_points(colonnade([-1.2, 0.0, 2.0], 3.5))
    record = estimate_step(source, target, None, np.array([ahead, 0.0, 0.0]), PARAMETERS)
    assert record.decision is Decision.SEARCH
    np.testing.assert_allclose(record.increment, STILL, atol=0.02)
