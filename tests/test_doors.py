"""Doors: what a beginner calls first, with what it cannot mean.

The law: whatever stands in any place of a call, the call takes it if it is what the place asks
for, and else raises a `LabkitError` that names the argument and says what it got.
"""

import math
from functools import partial
from itertools import product

import numpy as np
import pytest

from labkit import (
    LabkitError,
    Scan,
    align,
    align_svd,
    apply,
    compose,
    from_xytheta,
    icp,
    invert,
    read_log,
    to_xytheta,
    transform,
    wrap,
)
from labkit.evaluation import ate, compare, disagreement, forward_backward, rpe
from labkit.logs import read_tum
from labkit.plotting import book_figure, plot_scans, plot_trajectory
from labkit.se2 import relative, rotation
from labkit.simulation import Lidar, WheelNoise, room, scan_along, wheel_increments

NAN, INF = math.nan, math.inf
T, POSE = transform(1.0, 2.0, 0.3), np.array([1.0, 2.0, 0.3])
TWICE, FAILED = 2.0 * np.eye(3), np.full((3, 3), NAN)
POINTS = np.random.default_rng(0).uniform(-4.0, 4.0, (5, 2))
POSES = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 3))
SCAN, ANGLES, TURN = Scan.from_points(POINTS), np.linspace(-1.0, 1.0, 5), np.linspace(0, 360, 5)


def everything():
    """Arrays of every shape, sound and with each defect, and what is no array of numbers."""
    for shape in (shape for axes in range(4) for shape in product((0, 2, 3, 5), repeat=axes)):
        sound = np.random.default_rng(2).uniform(-1.0, 1.0, shape)
        yield from (sound, sound * 1j, sound.astype(str), sound.astype(object))
        for bad in (NAN, INF, 1e200) if sound.size else ():
            broken = sound.copy()
            broken.flat[0] = bad
            yield broken
        if sound.size:
            yield np.ma.masked_values(sound, sound.flat[0])
    yield from (
        None,
        "a",
        "1.5",
        ["1", "2", "3"],
        {"x": 1.0},
        invert,
        SCAN,
        [[1.0, 2.0], [3.0]],
        [],
    )
    yield from (T, FAILED, TWICE, T + INF, np.diag([1.0, -1.0, 1.0]), T[:2, :2], T[:2], np.eye(4))
    yield from (
        np.stack([T, T]),
        np.stack([T, FAILED]),
        np.stack([T, TWICE]),
        T + 1e-3,
        invert(FAILED),
        TURN,
    )


def numbers(value):
    """The numbers of `value` as an array; None where it holds anything else."""
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    return array if array.dtype.kind in "biuf" and not np.ma.is_masked(value) else None


def is_finite(value):
    return (array := numbers(value)) is not None and np.isfinite(array).all()


def are_transforms(value):
    if np.shape(numbers(value))[-2:] != (3, 3):
        return False
    T = np.reshape(value, (-1, 3, 3))
    T = T[~np.isnan(T[:, :2]).all(axis=(1, 2))]  # but those of a match that failed
    R = T[:, :2, :2]
    if not np.isfinite(T).all() or np.abs(R).max(initial=0.0) > 2.0:
        return False
    proper = np.allclose(R @ R.mT, np.eye(2), atol=1e-5) and (np.linalg.det(R) > 0.0).all()
    return proper and (T[:, 2] == [0.0, 0.0, 1.0]).all()


def are_poses(value):
    are_rows = is_finite(value) and np.shape(value)[-1:] == (3,)
    return are_rows and not (np.size(value) and are_transforms(value))


def are_points(value):
    if np.shape(numbers(value)) == (0,):  # as of an empty list
        return True
    is_table = is_finite(value) and np.ndim(value) == 2 and np.shape(value)[1] == 2
    return is_table and np.abs(value).max(initial=0.0) <= 1e12


def is_scan(value):
    return isinstance(value, Scan) or is_cloud(value)


def are_pairs(value):
    return are_points(value) and len(value) == 5


def are_ranges(value):
    """A masked range is a no-return, as NaN is."""
    given = value.data if isinstance(value, np.ma.MaskedArray) else value
    return np.shape(numbers(given)) == (5,)


def are_angles(value):
    return is_finite(value) and np.shape(value) == (5,) and np.ptp(value) <= 2.0 * math.pi


def is_one(value):
    return are_transforms(value) and np.ndim(value) == 2 and is_finite(value)


def is_one_or_none(value):
    return value is None or is_one(value)


def is_cloud(value):
    return are_points(value) and len(value) > 0


def are_poses_at(least, most=5):
    """Tell trajectories of so many poses, rows or transforms."""
    return lambda value: (
        (are_rows(value) or (are_transforms(value) and np.ndim(value) == 3 and is_finite(value)))
        and least <= len(value) <= most
    )


def are_rows(value):
    return are_poses(value) and np.ndim(value) == 2 and np.abs(value).max(initial=0.0) <= 1e12


AX = book_figure().subplots()
SCANS, FIVE = (POINTS, POINTS), ([are_poses_at(5)] * 2, (POSES, POSES))
ANY_NUMBERS = [lambda value: numbers(value) is not None]
DOORS = {  # what each place of the call asks for, and an example of it
    transform: ([is_finite] * 3, (1.0, 2.0, 0.3)),
    from_xytheta: ([are_poses], (POSE,)),
    to_xytheta: ([are_transforms], (T,)),
    compose: ([are_transforms] * 2, (T, T)),
    invert: ([are_transforms], (T,)),
    relative: ([are_transforms] * 2, (T, T)),
    apply: ([are_transforms, are_points], (T, POINTS)),
    wrap: (ANY_NUMBERS, (0.3,)),
    rotation: (ANY_NUMBERS, (0.3,)),
    Scan.from_ranges: ([are_ranges, are_angles], (np.ones(5), ANGLES)),
    Scan.from_points: ([are_points], (POINTS,)),
    align: ([are_pairs] * 2, SCANS),
    align_svd: ([are_pairs] * 2, SCANS),
    icp: ([is_scan, is_scan, is_one_or_none], (*SCANS, np.eye(3))),
    partial(scan_along, room(), lidar=Lidar(), rng=0): ([are_poses_at(1)], (POSES,)),
    partial(wheel_increments, noise=WheelNoise(), rng=0): ([are_poses_at(2)], (POSES,)),
    **dict.fromkeys((ate, rpe, forward_backward, disagreement), FIVE),
    partial(plot_scans, AX): ([is_scan, is_scan, is_one_or_none], (*SCANS, T)),
    partial(plot_trajectory, AX): ([are_poses_at(1)], (POSES,)),
}
PLACES = [(door, place) for door, (asks, _) in DOORS.items() for place in range(len(asks))]


@pytest.mark.parametrize(("door", "place"), PLACES)
def test_a_door_takes_what_it_asks_for_and_says_what_else_it_got(door, place):
    asks, example = DOORS[door]
    for given in everything():
        arguments = [*example[:place], given, *example[place + 1 :]]
        if asks[place](given):
            with np.errstate(invalid="ignore"):  # infinity is no angle: NaN
                door(*arguments)
            continue
        print(f"{given!r:.99}")  # shown where it fails
        with pytest.raises(LabkitError, match=r"(?s)^`[\w ,\[\]]+` .*\bgot "):
            door(*arguments)


@pytest.mark.parametrize("door", [ate, rpe, forward_backward, disagreement])
def test_rows_and_transforms_of_the_plane_and_of_space_are_the_same_poses(door):
    plane = from_xytheta(POSES)
    space = np.tile(np.eye(4), (5, 1, 1))
    space[np.ix_(range(5), [0, 1, 3], [0, 1, 3])] = plane
    for given in (plane, space):
        moved, expected = door(given, 2.0 * POSES), door(POSES, 2.0 * POSES)
        np.testing.assert_allclose(
            moved.translation_errors, expected.translation_errors, atol=1e-12
        )


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (partial(apply, POINTS, T), r"got shape \(5, 2\); .* `labkit\.apply\(T, points\)`"),
        (partial(apply, POSE, POINTS), r"got shape \(3,\); poses .* `labkit\.from_xytheta`"),
        (partial(apply, T, POINTS.T), r"got \(2, 5\); transpose it \(`\.T`\)"),
        (partial(apply, T, POINTS[0]), r"got \(2,\); one point is `\[\[x, y\]\]`"),
        (partial(apply, T, np.ones((5, 3))), r"got \(5, 3\); keep x and y"),
        (partial(apply, T, SCAN), r"got Scan\(5 points\); .*`scan\.points` of a scan"),
        (partial(apply, TWICE, POINTS), r"proper rigid .* got \[\[2\.0, 0\.0, 0\.0\]"),
        (partial(icp, POINTS, POINTS, FAILED), r"NaN, .* failed; print `result\.message`"),
        (partial(invert, np.stack([T, TWICE])), r"proper rigid transform, got \[\[2\.0"),
        (partial(to_xytheta, T[:2, :2]), r"got shape \(2, 2\); build one with `labkit\.transform"),
        (partial(to_xytheta, icp(POINTS, POINTS)), r"`result\.T_target_source` of a match"),
        (partial(ate, "run", POSES), r"numbers, got 'run'; .* `result\.poses` of a run"),
        (partial(compare, POSES, POSES), "`trajectories` must be of the class Mapping, got arr"),
        (partial(read_log, POINTS), "`path` must be of the class str or PathLike, got array"),
        (partial(read_tum, None), "`path` must be of the class str or PathLike, got None"),
        (partial(compose, [T, T]), r"compose\(\*transforms\)"),
        (partial(compose, np.stack([T, T]), np.stack([T] * 3)), "one leading shape, got"),
        (partial(from_xytheta, T), "got transforms: .* `labkit.to_xytheta`"),
        (partial(from_xytheta, [1.0, 2.0, 0.3, 4.0]), r"rows \(x, y, theta\), .* got \(4,\)"),
        (partial(transform, [1.0, 2.0], [1.0, 2.0, 3.0], 0.0), r"\(2,\), \(3,\) and \(\)"),
        (partial(Scan.from_points, np.ones(541)), r"got \(541,\); ranges go through `labkit\.Scan"),
        (partial(Scan.from_ranges, POINTS, ANGLES), r"\(5, 2\); .*points .* `Scan\.from_points`"),
        (partial(Scan.from_ranges, np.ones(5), [-1, 1]), r"\(5,\) and \(2,\); `np\.linspace\(fir"),
        (partial(Scan.from_ranges, np.ones(5), TURN), r"0 to 360: are these degrees\? us"),
        (partial(Scan.from_ranges, [1.0], [90.0]), r"90: are these degrees\? use `np\.radians`"),
        (partial(Scan.from_ranges, [1.0], [0.0], range_max="3"), r"`range_max` must be .* got '3'"),
        (partial(align, POINTS, POINTS[:3]), "must be pairs, got 5 and 3 points; row i of one"),
        (partial(align, POINTS, POINTS * 1e154), r"`target` must lie within 1e\+12 m, got .* inde"),
        (partial(icp, POINTS, POINTS, POSE), r"`T_init` .* poses .* `labkit\.from_xytheta`"),
    ],
)
def test_a_slip_is_told_the_call_that_was_meant(call, meant):
    with pytest.raises(LabkitError, match=meant):
        call()
