"""Doors: what a beginner calls first, with what it cannot mean.

The law: whatever stands in any place of a call, the call takes it if it is what the place asks
for, and else raises a `LabkitError` that names the argument and says what it got.
"""

import math
from functools import partial

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
    to_xytheta,
    transform,
    wrap,
)
from labkit.se2 import relative, rotation

NAN, INF = math.nan, math.inf
T, POSE = transform(1.0, 2.0, 0.3), np.array([1.0, 2.0, 0.3])
POINTS = np.random.default_rng(0).uniform(-4.0, 4.0, (5, 2))
ANGLES = np.linspace(-1.0, 1.0, 5)

GIVEN = {
    "text": "a",
    "number as text": "1.5",
    "texts": ["1", "2", "3"],
    "nothing": None,
    "dict": {"x": 1.0},
    "function": invert,
    "scan": Scan.from_points(POINTS),
    "complex": POSE * 1j,
    "ragged": [[1.0, 2.0], [3.0]],
    "object": np.array([1, None]),
    "number": 0.5,
    "NaN": NAN,
    "inf": INF,
    "pair": [1.0, 2.0],
    "four": [1.0, 2.0, 0.3, 4.0],
    "empty": [],
    "no points": np.empty((0, 2)),
    "pose": POSE,
    "poses": np.tile(POSE, (4, 1)),
    "NaN pose": [1.0, NAN, 0.3],
    "three poses": np.tile(POSE, (3, 1)),
    "transform": T,
    "transforms": np.stack([T, T]),
    "no transforms": np.empty((0, 3, 3)),
    "failed": np.full((3, 3), NAN),
    "two I": 2.0 * np.eye(3),
    "far": transform(1, 2, 3) + INF,
    "mirror": np.diag([1.0, -1.0, 1.0]),
    "last row": T + np.eye(3)[[1, 0, 2]].T * 1e-3,
    "R": T[:2, :2],
    "half": T[:2],
    "in space": np.eye(4),
    "wrong one": np.stack([T, 2.0 * T]),
    "points": POINTS,
    "transposed": POINTS.T,
    "NaN points": POINTS * [1.0, NAN],
    "far points": POINTS * 1e200,
    "xyz": np.ones((5, 3)),
    "homogeneous": np.ones((3, 5)),
    "masked": np.ma.masked_invalid(POINTS * [1.0, NAN]),
    "ranges": np.ones(5),
    "angles": ANGLES,
    "degrees": np.degrees(ANGLES),
    "turn": np.linspace(0.0, 360.0, 5),
}


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
    if np.isnan(value).all():  # of a match that failed
        return True
    R = np.asarray(value)[..., :2, :2]
    proper = np.allclose(R @ R.mT, np.eye(2), atol=1e-5) and (np.linalg.det(R) > 0.0).all()
    return proper and (np.asarray(value)[..., 2, :] == [0.0, 0.0, 1.0]).all()


def are_poses(value):
    are_rows = is_finite(value) and np.shape(value)[-1:] == (3,)
    return are_rows and not (are_transforms(value) and np.size(value))


def are_points(value):
    if isinstance(value, list) and not value:
        return True
    is_table = is_finite(value) and np.ndim(value) == 2 and np.shape(value)[1] == 2
    return is_table and np.abs(value).max(initial=0.0) <= 1e9


def is_scan(value):
    return isinstance(value, Scan) or (are_points(value) and len(value) > 0)


def are_pairs(value):
    return are_points(value) and len(value) == 5


def are_ranges(value):
    return numbers(value) is not None and np.shape(value) == (5,)


def are_angles(value):
    return is_finite(value) and np.shape(value) == (5,) and np.ptp(value) <= 2.0 * math.pi


def is_one(value):
    return value is None or (are_transforms(value) and np.ndim(value) == 2 and is_finite(value))


SCANS = (POINTS, POINTS)
DOORS = {  # what each place of the call asks for, and an example of it
    transform: ([is_finite] * 3, (1.0, 2.0, 0.3)),
    from_xytheta: ([are_poses], (POSE,)),
    to_xytheta: ([are_transforms], (T,)),
    compose: ([are_transforms] * 2, (T, T)),
    invert: ([are_transforms], (T,)),
    relative: ([are_transforms] * 2, (T, T)),
    apply: ([are_transforms, are_points], (T, POINTS)),
    wrap: ([lambda value: numbers(value) is not None], (0.3,)),
    rotation: ([lambda value: numbers(value) is not None], (0.3,)),
    Scan.from_ranges: ([are_ranges, are_angles], (np.ones(5), ANGLES)),
    Scan.from_points: ([are_points], (POINTS,)),
    align: ([are_pairs] * 2, SCANS),
    align_svd: ([are_pairs] * 2, SCANS),
    icp: ([is_scan, is_scan, is_one], (*SCANS, np.eye(3))),
}
PLACES = [(door, place) for door, (asks, _) in DOORS.items() for place in range(len(asks))]


@pytest.mark.parametrize("given", GIVEN)
@pytest.mark.parametrize(
    ("door", "place"), PLACES, ids=lambda each: getattr(each, "__name__", each)
)
def test_a_door_takes_what_it_asks_for_and_says_what_else_it_got(door, place, given):
    asks, example = DOORS[door]
    arguments = list(example)
    arguments[place] = GIVEN[given]
    if asks[place](GIVEN[given]):
        with np.errstate(invalid="ignore"):  # infinity is no angle: NaN
            door(*arguments)
        return
    with pytest.raises(LabkitError, match=r"(?s)^`[\w ,\[\]]+` .*\bgot "):
        door(*arguments)


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (partial(apply, POINTS, T), r"got shape \(5, 2\); .* `labkit\.apply\(T, points\)`"),
        (partial(apply, POSE, POINTS), r"got shape \(3,\); poses .* `labkit\.from_xytheta`"),
        (partial(apply, T, POINTS.T), r"got \(2, 5\); transpose it \(`\.T`\)"),
        (partial(apply, T, POINTS[0]), r"got \(2,\); one point is `\[\[x, y\]\]`"),
        (partial(apply, T, np.ones((5, 3))), r"got \(5, 3\); keep x and y"),
        (partial(apply, T, GIVEN["scan"]), r"got Scan\(5 points\); .*`scan\.points` of a scan"),
        (partial(apply, 2.0 * np.eye(3), POINTS), r"proper rigid .* got \[\[2\.0, 0\.0, 0\.0\]"),
        (partial(icp, POINTS, POINTS, GIVEN["failed"]), r"NaN, .* failed; print `result\.message`"),
        (partial(invert, GIVEN["wrong one"]), r"proper rigid transform, got \[\[1\.9"),
        (partial(to_xytheta, np.eye(4)), r"got shape \(4, 4\); of one in space take `T\[np\.ix_"),
        (partial(to_xytheta, T[:2, :2]), r"got shape \(2, 2\)"),
        (partial(compose, [T, T]), r"compose\(\*transforms\)"),
        (partial(compose, np.stack([T, T]), np.stack([T] * 3)), "one leading shape, got"),
        (partial(from_xytheta, T), "got transforms: .* `labkit.to_xytheta`"),
        (partial(from_xytheta, [1.0, 2.0, 0.3, 4.0]), r"rows \(x, y, theta\), .* got \(4,\)"),
        (partial(transform, [1.0, 2.0], [1.0, 2.0, 3.0], 0.0), r"\(2,\), \(3,\) and \(\)"),
        (partial(Scan.from_points, np.ones(541)), r"got \(541,\); ranges go through `labkit\.Scan"),
        (partial(Scan.from_ranges, POINTS, ANGLES), r"\(5, 2\); points .* `Scan\.from_points`"),
        (partial(Scan.from_ranges, np.ones(5), [-1, 1]), r"\(5,\) and \(2,\); `np\.linspace\(fir"),
        (partial(Scan.from_ranges, np.ones(5), GIVEN["turn"]), r"0 to 360: are these degrees\? us"),
        (partial(Scan.from_ranges, [1.0], [90.0]), r"90: are these degrees\? use `np\.radians`"),
        (partial(Scan.from_ranges, [1.0], [0.0], range_max="3"), r"`range_max` must be .* got '3'"),
        (partial(align, POINTS, POINTS[:3]), "must be pairs, got 5 and 3 points; row i of one"),
        (partial(align, POINTS, POINTS * 1e154), r"`target` must lie within 1e\+09 m, got .* inde"),
        (partial(icp, POINTS, POINTS, POSE), r"`T_init` .* poses .* `labkit\.from_xytheta`"),
    ],
)
def test_a_slip_is_told_the_call_that_was_meant(call, meant):
    with pytest.raises(LabkitError, match=meant):
        call()
