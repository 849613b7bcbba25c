"""Chapter 3: which points make a pair, and how much a pair may pull."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from labkit import Scan, Target, align, apply, filters, icp, se2, transform
from labkit.arrays import BoolArray, FloatArray
from labkit.correspondences import huber_weights
from labkit.course.exercises.exercise import Case, exercise
from labkit.simulation import Lidar, cast, room


@exercise("The gate as a loss")
def truncated_square() -> Iterator[Case]:
    """For residuals on both sides of the gate and on it."""
    r, d_max = np.array([0.0, 0.1, 0.3, 0.5, 0.8, 3.0]), 0.5
    squares = np.array([0.0, 0.01, 0.09, 0.25, 0.25, 0.25])
    inside = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    yield Case(
        "a gate of 0.5 m",
        (r, d_max),
        (squares, inside),
        {
            "A pair beyond the gate is charged nothing. Then the scan could lower its cost by "
            "losing pairs; charge d_max² instead.": (squares * inside, inside),
            "These are Huber's weights. The slope of the truncated square beyond the gate is 0.": (
                squares,
                huber_weights(r, d_max),
            ),
            "The loss is not cut: beyond the gate it stays at d_max².": (r**2, inside),
            "A pair exactly on the gate counts as inside, as in `distance_gate`.": (
                squares,
                np.where(r < d_max, 1.0, 0.0),
            ),
        },
    )


@exercise("Mutual pairs")
def mutual_pairs() -> Iterator[Case]:
    """For points of which some share a partner, and some have none."""
    rng = np.random.default_rng(6)
    q = rng.uniform(0.0, 5.0, (30, 2))
    p = np.vstack([q[:20] + rng.normal(0.0, 0.2, (20, 2)), rng.uniform(6.0, 8.0, (10, 2))])
    gaps = np.hypot(*(p[:, None] - q).transpose(2, 0, 1))
    there, back = gaps.argmin(axis=1), gaps.argmin(axis=0)
    yield Case(
        "30 points, ten of them without a partner",
        (p, q),
        back[there] == np.arange(len(p)),
        {
            "This asks whether a *target* point's partner leads back to it; begin with the source "
            "point.": there[back] == np.arange(len(q)),
            "This asks whether a partner is nobody else's. A far point can have one, too; search "
            "from the target back to the source.": np.bincount(there, minlength=30)[there] == 1,
            "`back[there]` is a source point. Compare it with the source point that it began with, "
            "not with its partner.": back[there] == there,
        },
    )


@exercise("Search among nearby beams")
def nearest_in_window() -> Iterator[Case]:
    """For scans with missing beams, so that beams and rows differ."""
    rng = np.random.default_rng(7)
    beams_q = np.sort(rng.choice(60, 25, replace=False))
    beams_p = np.sort(rng.choice(80, 20, replace=False))
    p, q = rng.uniform(0.0, 5.0, (20, 2)), rng.uniform(0.0, 5.0, (25, 2))
    squares = np.square(p[:, None] - q).sum(axis=2)
    apart = abs(beams_p[:, None] - beams_q)
    rows = abs(np.arange(20)[:, None] - np.arange(25))

    def nearest(allowed: BoolArray) -> FloatArray:
        index = np.where(allowed, squares, np.inf).argmin(axis=1)
        return np.where(allowed.any(axis=1), index, -1)

    for width in (4, 15):
        yield Case(
            f"a window of {width} beams",
            (p, q, beams_p, beams_q, width),
            nearest(apart <= width),
            {
                "The window is counted in rows. Beams without a return are missing from the "
                "points, so compare `beams_p` with `beams_q`.": nearest(rows <= width),
                "A beam exactly `width` away is inside the window.": nearest(apart < width),
                "The window has no effect: this is the nearest of all target points.": nearest(
                    apart >= 0
                ),
                "Where the window holds no target point, the answer is −1; the smallest of "
                "infinite distances is at index 0.": np.where(
                    apart <= width, squares, np.inf
                ).argmin(axis=1),
            },
        )


@exercise("A gate that follows the data")
def match_by_median_gate() -> Iterator[Case]:
    """In a room, from no guess and from one."""
    older, newer = (
        cast(room(), transform(1.0, -0.5, 0.3) @ T, Lidar(beam_count=181), rng=seed).points
        for seed, T in enumerate((np.eye(3), transform(0.3, 0.1, 0.15)))
    )
    guesses = {"no guess": np.eye(3), "a guess": transform(0.2, 0.0, 0.1)}
    for where, guess in guesses.items():
        yield Case(
            where,
            (newer, older, guess),
            _gated(newer, older, guess, lambda d: 3.0 * float(np.median(d))),
            {
                "The gate is the median itself; three times the median is asked.": _gated(
                    newer, older, guess, lambda d: float(np.median(d))
                ),
                "The gate is three times the *mean*, which a few far points pull up.": _gated(
                    newer, older, guess, lambda d: 3.0 * float(np.mean(d))
                ),
                "No pair is rejected: align only those within the gate.": _gated(
                    newer, older, guess, lambda d: np.inf
                ),
            },
        )


@exercise("A mast in the way")
def typical_error() -> Iterator[Case]:
    """For scans whose first beams a mast covers."""
    T_true, pairs = transform(0.2, 0.1, 0.05), []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        T = transform(0.5, -0.4, 0.3 * seed)
        pairs.append(tuple(_behind_a_mast(each, rng) for each in (T @ T_true, T)))
    clean = filters.Preprocessing(range_min=0.4)
    errors = _errors(pairs, T_true, clean, clean)
    yield Case(
        "three pairs of scans behind a mast",
        (pairs, T_true, clean),
        float(np.median(errors)),
        {
            "The filter is applied to the older scan alone; the mast stands in the newer one, "
            "too.": float(np.median(_errors(pairs, T_true, lambda scan: scan, clean))),
            "The scans are matched as they are: apply `clean` to each.": float(
                np.median(_errors(pairs, T_true, lambda scan: scan, lambda scan: scan))
            ),
            "This is the mean; one failed match would decide it alone.": float(np.mean(errors)),
        },
    )


def _gated(
    p: FloatArray, q: FloatArray, T: FloatArray, gate: Callable[[FloatArray], float]
) -> FloatArray:
    target = Target(q)
    for _ in range(60):
        moved = apply(T, p)
        index, d = target.search.query(moved)
        near = d <= gate(d)
        T = align(moved[near], target.points[index[near]]) @ T
    return T


def _behind_a_mast(T: FloatArray, rng: np.random.Generator) -> Scan:
    scan = cast(room(), T, Lidar(beam_count=181), rng=rng)
    assert scan.ranges is not None
    assert scan.angles is not None
    ranges = np.array(scan.ranges)
    ranges[:40] = 0.25 + rng.normal(0.0, 0.01, 40)
    return Scan.from_ranges(ranges, scan.angles)


def _errors(
    pairs: list[tuple[Scan, ...]],
    T_true: FloatArray,
    first: Callable[[Scan], Scan],
    second: Callable[[Scan], Scan],
) -> list[float]:
    ends = [icp(first(newer), second(older)).T_target_source for newer, older in pairs]
    return [float(np.hypot(*se2.relative(T_true, T)[:2, 2])) for T in ends]
