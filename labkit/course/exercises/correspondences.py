"""Chapter 3: which points make a pair, and how much a pair may pull."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from labkit import Scan, Target, align, apply, filters, icp, invert, se2, transform
from labkit.arrays import FloatArray
from labkit.correspondences import huber_weights
from labkit.course.exercises.exercise import Arguments, exercise
from labkit.simulation import Lidar, cast, room

Pair = tuple[FloatArray, FloatArray]


# fmt: off
@exercise("The gate as a loss", {
    "a gate of 0.5 m": (np.array([0.0, 0.1, 0.3, 0.5, 0.8, 3.0]), 0.5),
    "a gate of 2 m": (np.array([1.5, 4.0, 2.0, 0.3]), 2.0),
}, {
    "A pair beyond the gate is charged nothing. Then the scan could lower its cost by losing "
    "pairs; charge d_max² instead.": lambda r, d: (r**2 * (r <= d), (r <= d) * 1),
    "These are Huber's weights. The slope of the truncated square beyond the gate is 0.":
        lambda r, d: (truncated_square(r, d)[0], huber_weights(r, d)),
    "The loss is not cut: beyond the gate it stays at d_max².":
        lambda r, d: (r**2, (r <= d) * 1),
    "A pair exactly on the gate counts as inside, as in `distance_gate`.":
        lambda r, d: (truncated_square(r, d)[0], (r < d) * 1),
    "The square is held against d_max; both are squares, d_max² is the limit.":
        lambda r, d: (np.minimum(r**2, d), (r <= d) * 1),
    "The weights hold the square against d_max; the gate is in metres.":
        lambda r, d: (truncated_square(r, d)[0], (r**2 <= d) * 1),
    "The losses are not squared: they are min(r², d_max²), in m².":
        lambda r, d: (np.minimum(r, d), (r <= d) * 1),
    "The losses are halved; this book's loss is min(r², d_max²), without ½.":
        lambda r, d: (truncated_square(r, d)[0] / 2, (r <= d) * 1),
    "The weights are inverted: 1 belongs to the pairs within the gate.":
        lambda r, d: (truncated_square(r, d)[0], (r > d) * 1),
    "The weights are the losses' slope in r; asked for is the slope in s = r².":
        lambda r, d: (truncated_square(r, d)[0], 2 * r * (r <= d)),
})
def truncated_square(r: FloatArray, d_max: float) -> Pair:
    """One entry after the other."""
    pairs = [(x * x, 1.0) if x <= d_max else (d_max * d_max, 0.0) for x in r]
    return np.array([loss for loss, _ in pairs]), np.array([weight for _, weight in pairs])


def _sharing() -> Arguments:
    rng = np.random.default_rng(6)
    q = rng.uniform(0.0, 5.0, (30, 2))
    p = np.vstack([q[:20] + rng.normal(0.0, 0.2, (20, 2)), rng.uniform(6.0, 8.0, (10, 2))])
    return {"30 points, ten of them without a partner": (p, q)}


def _both_ways(p: FloatArray, q: FloatArray) -> Any:
    gaps = np.hypot(*(p[:, None] - q).transpose(2, 0, 1))
    return gaps.argmin(axis=1), gaps.argmin(axis=0), np.arange(len(p)), gaps


@exercise("Mutual pairs", _sharing, {
    "This asks whether a *target* point's partner leads back to it; begin with the source point.":
        lambda p, q: mutual_pairs(q, p),
    "This asks whether a partner is nobody else's. A far point can have one, too; search back.":
        lambda p, q: np.bincount(_both_ways(p, q)[0], minlength=len(q))[_both_ways(p, q)[0]] == 1,
    "`back[there]` is a source point: compare it with the one that it began with, not its partner.":
        lambda p, q: (b := _both_ways(p, q))[1][b[0]] == b[0],
    "`there` and `back` are compared entry by entry; they count different points.":
        lambda p, q: _both_ways(p, q)[0] == _both_ways(p, q)[1],
    "These are the indices of the mutual points; asked for is a mask, one entry a point.":
        lambda p, q: np.flatnonzero(mutual_pairs(p, q)),
    "The mask is inverted: it is True where the way back ends elsewhere.":
        lambda p, q: ~mutual_pairs(p, q),
    "Every point has a nearest neighbour; ask whether the way back leads to where it began.":
        lambda p, q: np.ones(len(p), dtype=bool),
    "A pair is mutual by the way back, not by a limit on its distance.":
        lambda p, q: _both_ways(p, q)[3].min(axis=1) < 0.5,
})
def mutual_pairs(p: FloatArray, q: FloatArray) -> FloatArray:
    """From the table of all distances."""
    there, back, each, _ = _both_ways(p, q)
    return np.asarray(back[there] == each)


def _beams() -> Arguments:
    rng = np.random.default_rng(7)
    beams_q = np.sort(rng.choice(60, 25, replace=False))
    beams_p = np.sort(rng.choice(80, 20, replace=False))
    p, q = rng.uniform(0.0, 5.0, (20, 2)), rng.uniform(0.0, 5.0, (25, 2))
    return {f"a window of {w} beams": (p, q, beams_p, beams_q, w) for w in (4, 15)}


def _window(p: FloatArray, q: FloatArray, allowed: Any, none: int | None = -1) -> Any:
    squares = np.where(allowed, np.square(p[:, None] - q).sum(axis=2), np.inf)
    index = squares.argmin(axis=1)
    return index if none is None else np.where(allowed.any(axis=1), index, none)


def _rows(p: FloatArray, q: FloatArray) -> Any:
    return abs(np.arange(len(p))[:, None] - np.arange(len(q)))


@exercise("Search among nearby beams", _beams, {
    "The window is counted in rows. Beams without a return are missing from the points, so compare "
    "`beams_p` with `beams_q`.": lambda p, q, a, b, w: _window(p, q, _rows(p, q) <= w),
    "A beam exactly `width` away is inside the window.":
        lambda p, q, a, b, w: _window(p, q, abs(a[:, None] - b) < w),
    "The window has no effect: this is the nearest of all target points.":
        lambda p, q, a, b, w: _window(p, q, _rows(p, q) >= 0),
    "Where the window is empty the answer is −1; the smallest of infinite distances is at 0.":
        lambda p, q, a, b, w: _window(p, q, abs(a[:, None] - b) <= w, none=None),
    "The window reaches to one side only: take the absolute difference of the beams.":
        lambda p, q, a, b, w: _window(p, q, b - a[:, None] <= w),
    "The window reaches to one side only: the target's beam may lie before the source's.":
        lambda p, q, a, b, w: _window(p, q, (b - a[:, None] <= w) & (b >= a[:, None])),
    "The window is half as wide: `width` counts to either side.":
        lambda p, q, a, b, w: _window(p, q, abs(a[:, None] - b) <= w / 2),
    "These are beams; asked for are the rows of `q`.":
        lambda p, q, a, b, w: np.where((i := nearest_in_window(p, q, a, b, w)) < 0, -1, b[i]),
    "This is the nearest *beam* in the window; asked for is the nearest point.":
        lambda p, q, a, b, w: np.where((gap := abs(a[:, None] - b)).min(1) <= w, gap.argmin(1), -1),
    "The search is over source points, for each target point: exchange them.":
        lambda p, q, a, b, w: nearest_in_window(q, p, b, a, w),
    "The nearest point is sought first and dropped if it lies outside; seek inside the window.":
        lambda p, q, a, b, w: np.where(
            abs(a - b[(i := _window(p, q, _rows(p, q) >= 0))]) <= w, i, -1),
})
def nearest_in_window(p: Any, q: Any, beams_p: Any, beams_q: Any, width: int) -> FloatArray:
    """Infinite distances outside the window."""
    return np.asarray(_window(p, q, abs(beams_p[:, None] - beams_q) <= width))


@cache
def _two_guesses() -> Arguments:
    older, newer = (
        cast(room(), transform(1.0, -0.5, 0.3) @ T, Lidar(beam_count=181), rng=seed).points
        for seed, T in enumerate((np.eye(3), transform(0.3, 0.1, 0.15)))
    )
    back = apply(invert(transform(0.4, -0.2, 1.0)), newer)
    return {
        "no guess": (newer, older, np.eye(3)),
        "a guess": (newer, older, transform(0.2, 0.0, 0.1)),
        "a robot that has turned far": (back, older, transform(0.3, -0.2, 0.95)),
    }


def _gated(p: FloatArray, q: FloatArray, T: FloatArray, gate: Any = lambda d: 3 * np.median(d),
           update: Any = lambda dT, T: dT @ T) -> FloatArray:
    target = Target(q)
    for _ in range(60):
        moved = apply(T, p)
        index, d = target.search.query(moved)
        near = d <= gate(d)
        T = update(align(moved[near], target.points[index[near]]), T)
    return T


@exercise("A gate that follows the data", _two_guesses, {
    "The gate is the median itself; three times the median is asked.":
        lambda p, q, T: _gated(p, q, T, np.median),
    "The gate is three times the *mean*, which a few far points pull up.":
        lambda p, q, T: _gated(p, q, T, lambda d: 3 * d.mean()),
    "No pair is rejected: align only those within the gate.":
        lambda p, q, T: _gated(p, q, T, lambda d: np.inf),
    "The step is composed on the wrong side, `T @ dT`: it acts after `T`, so `dT @ T`.":
        lambda p, q, T: _gated(p, q, T, update=lambda dT, T: T @ dT),
    "This is the last step alone, `T = dT`; chain the steps, `dT @ T`.":
        lambda p, q, T: _gated(p, q, T, update=lambda dT, T: dT),
    "The guess comes back as it was: no step reaches `T`.": lambda p, q, T: T,
    "The gate is three times the median of the *squares*; distances are in metres.":
        lambda p, q, T: _gated(p, q, T, lambda d: 3 * np.median(d**2)),
    "The gate is found once, at the guess; it follows the distances in each round.":
        lambda p, q, T: _gated(p, q, T, (lambda gate: lambda d: gate)(
            3 * np.median(Target(q).search.query(apply(T, p))[1]))),
    "The gate is a third of the median; three times the median is asked.":
        lambda p, q, T: _gated(p, q, T, lambda d: np.median(d) / 3),
})
def match_by_median_gate(source: FloatArray, target: FloatArray, T_init: FloatArray) -> FloatArray:
    """Sixty rounds."""
    return _gated(source, target, T_init)


@cache
def _masts() -> Arguments:
    T_true, pairs = transform(0.2, 0.1, 0.05), []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        T = transform(0.5, -0.4, 0.3 * seed)
        pairs.append(tuple(_behind_a_mast(each, rng) for each in (T @ T_true, T)))
    clean = filters.Preprocessing(range_min=0.4, voxel_size=0.1)
    return {"three pairs of scans behind a mast": (pairs, T_true, clean)}


def _behind_a_mast(T: FloatArray, rng: np.random.Generator) -> Scan:
    scan = cast(room(), T, Lidar(beam_count=181), rng=rng)
    assert scan.ranges is not None
    assert scan.angles is not None
    ranges = np.array(scan.ranges)
    ranges[:60] = 0.25 + rng.normal(0.0, 0.01, 60)
    return Scan.from_ranges(ranges, scan.angles)


def _off(pairs: Any, T: FloatArray, new: Any, old: Any, run: Any = icp) -> Any:
    off = [se2.relative(T, run(new(a), old(b)).T_target_source) for a, b in pairs]
    return np.hypot(*np.array(off)[:, :2, 2].T)


def _as_it_is(scan: Scan) -> Scan:
    return scan


@exercise("A mast in the way", _masts, {
    "The filter is applied to the older scan alone; the mast stands in the newer one, too.":
        lambda pairs, T, f: np.median(_off(pairs, T, _as_it_is, f)),
    "The filter is applied to the newer scan alone; the mast stands in the older one, too.":
        lambda pairs, T, f: np.median(_off(pairs, T, f, _as_it_is)),
    "The scans are matched as they are: apply `clean` to each.":
        lambda pairs, T, f: np.median(_off(pairs, T, _as_it_is, _as_it_is)),
    "This is the mean; one failed match would decide it alone.":
        lambda pairs, T, f: np.mean(_off(pairs, T, f, f)),
    "This is the root mean square; asked for is the median.":
        lambda pairs, T, f: np.sqrt(np.mean(_off(pairs, T, f, f) ** 2)),
    "This is the largest error; asked for is the median.":
        lambda pairs, T, f: np.max(_off(pairs, T, f, f)),
    "Source and target are swapped: the newer scan is the source.":
        lambda pairs, T, f: np.median(_off(pairs, T, f, f, lambda p, q: icp(q, p))),
    "This is the length of the motion found; its error is held against `T_true`.":
        lambda pairs, T, f: np.median(_off(pairs, np.eye(3), f, f)),
    "This is the error of the heading; asked for is that of the translation.":
        lambda pairs, T, f: np.median([
            abs(se2.to_xytheta(se2.relative(T, icp(f(a), f(b)).T_target_source))[2])
            for a, b in pairs]),
})
def typical_error(pairs: Any, T_true: FloatArray, clean: Any) -> Any:
    """The median is not moved by a match that fails."""
    return np.median(_off(pairs, T_true, clean, clean))
