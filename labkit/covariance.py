"""Covariance of a match in Censi's closed form: how far to trust it (section 5).

The estimate x = (Δx, Δy, Δψ) minimises a cost J(x, z) of the measured ranges z. Where the
gradient ∂J/∂x vanishes, the implicit function theorem tells how x follows z, so

    cov(x) ≈ A⁻¹ B cov(z) Bᵀ A⁻¹ ,   A = ∂²J/∂x² ,   B = ∂²J/∂z ∂x               (6.4)

J is the point-to-line cost Σ wᵢ rᵢ², rᵢ = nᵢ·(R pᵢ + t − qᵢ), with the correspondences,
normals and weights of the last association held fixed. cov(z) is the noise of the ranges; the
target's points show it, since they scatter about their lines (`range_noise`). Five things are
added to [1]:

- A free direction of the motion carries no information. The noisy normals show it 3° off at
  541 beams with 30 mm of noise. So the scan is moved along it to either side, and back onto the
  surfaces; the free direction is the line between the two places.
- Dense points lie on lines through all points within `Target.line_width`, so the noise of such a
  neighbourhood is shared by all pairs that end there.
- Residuals show what cov(z) does not know: bent surfaces, rounded values, worse ranges. On one
  stretch of a surface they err together. So what the residuals of each stretch pull, beyond what
  cov(z) explains, is added.
- The point-to-point metric pulls along the surfaces as well. These pulls do not hold the
  scan, because the pairs change when it slides: they count as pulls of their stretch.
- Where the estimate is not the minimum, the step back to it is added.

The formula knows one minimum, and cannot know whether it is the right one (`python
tests/bench/density.py` compares it with the errors). Among points that lie closer together than
their noise a scan has partners near by wherever it lies. So it is moved a little there and paired
anew; if little of the pull is left, there is no covariance (the posts of doors with 5 cm of noise).

References
----------
.. [1] Censi, "An accurate closed-form estimate of ICP's covariance", ICRA 2007.
.. [2] Bonnabel, Barczyk, Goulette, "On the covariance of ICP-based scan-matching
       techniques", ACC 2016 (why fixed pairs do for lines, and not for points).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from labkit.correspondences import Correspondences, pairs_at, weights_of
from labkit.degeneracy import follow_surfaces, observability
from labkit.line_alignment import MIN_INFORMATION, line_residuals, line_rows
from labkit.normals import MAX_NEIGHBOR_DISTANCE, estimate_normals, is_cloud
from labkit.parameters import IcpParameters
from labkit.scan import Scan
from labkit.se2 import from_xytheta, to_xytheta
from labkit.support.arrays import (
    EPSILON,
    FloatArray,
    IntArray,
    as_covariance,
    as_numbers,
    check_range,
)
from labkit.support.errors import DegenerateAlignmentError, InvalidParameterError
from labkit.target import Target

ALONG_AN_AXIS = 0.02  # component of a free direction below which its axis is not free
MIN_HELD_SHARE = 1.0 / 3.0  # of the pull of fixed pairs; an overlap of 0.85 alone leaves half
MAX_RANGE_STD = 100.0  # [m], of a range: no scanner is worse


@runtime_checkable
class _Result(Protocol):
    """The part of a `labkit.IcpResult` that a covariance reads; its module imports this one."""

    @property
    def source(self) -> Scan: ...
    @property
    def target(self) -> Target: ...
    @property
    def parameters(self) -> IcpParameters: ...
    @property
    def correspondences(self) -> Correspondences: ...
    @property
    def T_target_source(self) -> FloatArray: ...
    @property
    def message(self) -> str: ...


def censi_covariance(result: _Result, range_std: float | None = None) -> FloatArray:
    """Covariance of an estimated motion, from the noise of the ranges.

    Parameters
    ----------
    result : IcpResult
        The result of `labkit.icp`.
    range_std : float, optional
        Standard deviation of one range of either scan [m]. It is a lower bound: the target
        and the residuals may show more noise, see `range_noise`.

    Returns
    -------
    ndarray, shape (3, 3)
        Of (Δx, Δy, Δψ), in m², m rad and rad²: infinite along free directions, and for an
        axis that leans towards one by more than 1°.

    Raises
    ------
    DegenerateAlignmentError
        Where the match failed, no pair lies on a surface, or other pairs are as near
        wherever the scan lies.
    InvalidParameterError
        For a `range_std` out of range, or none where the target shows no noise.
    """
    covariance_seen, seen, free = _covariance_and_bases(result, range_std)
    covariance = seen @ covariance_seen @ seen.T
    for direction in free.T:
        signs = np.where(np.abs(direction) > ALONG_AN_AXIS, np.sign(direction), 0.0)
        products = np.outer(signs, signs)
        covariance[products != 0.0] = math.inf * products[products != 0.0]
    return covariance


def range_noise(result: _Result, range_std: float | None = None) -> float:
    """Standard deviation [m] of one range that the covariance of a match takes.

    It is the larger one of `range_std`, if that is given, and of what the target's points show,
    `Target.noise`. Raises `InvalidParameterError` where there is neither.
    """
    _check_result(result)
    shown = result.target.noise
    if range_std is None and math.isnan(shown):
        problem = "must be given [m]: no point of the target shows any noise"
        raise InvalidParameterError(problem, parameter="range_std")
    if range_std is None:
        return shown
    given = check_range(range_std, "range_std", above=0.0, at_most=MAX_RANGE_STD, unit="m")
    return float(np.fmax(given, shown))


def censi_information(result: _Result, range_std: float | None = None) -> FloatArray:
    """Information Ω, the inverse of `censi_covariance`: a free direction v has ``Ω @ v == 0``."""
    covariance_seen, seen, free = _covariance_and_bases(result, range_std)
    to_seen = np.linalg.inv(np.column_stack([seen, free]))[: seen.shape[1]]  # coordinates in `seen`
    return np.asarray(to_seen.T @ np.linalg.solve(covariance_seen, to_seen))


def fuse(
    result: _Result, range_std: float | None, prior: ArrayLike, prior_covariance: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Fuse a match with the prior that it began from: the most likely motion, and its covariance.

    Informations add, and the mean is weighted by them; along a free direction the prior alone
    counts: (Δx, Δy, Δψ) by wheels or an IMU, shape (3,), with a positive definite covariance,
    shape (3, 3). `result` and `range_std` are as in `censi_covariance`.
    """
    P = as_covariance(prior_covariance, "prior_covariance", 3, definite=True)
    information = censi_information(result, range_std)
    covariance = np.linalg.inv(information + np.linalg.inv(P))
    mean = as_numbers(prior, "prior")
    difference = to_xytheta(result.T_target_source) - mean
    difference[2] = math.remainder(difference[2], math.tau)
    return mean + covariance @ information @ difference, covariance


class _LinePairs(NamedTuple):
    """The kept pairs that lie on a surface, in the target's frame."""

    source: FloatArray  # R p + t [m], shape (N, 2)
    arm: FloatArray  # R p: from the source's scanner to the point [m], shape (N, 2)
    target: FloatArray  # q [m], shape (N, 2)
    target_index: IntArray  # row of q in the target, shape (N,)
    normals: FloatArray  # n, at q, shape (N, 2)
    weights: FloatArray  # w, shape (N,)
    residuals: FloatArray  # r = n·(R p + t − q) [m], shape (N,)
    slope: FloatArray  # ∂r/∂x in the S directions that are seen, shape (N, S)
    seen_turn: FloatArray  # Δψ of those directions, shape (S,)


def _covariance_and_bases(
    result: _Result, range_std: float | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Covariance (6.4) in the coordinates of the motions that the pairs see, and the two bases."""
    noise = range_noise(result, range_std)
    if np.isnan(result.T_target_source[0, 0]):
        raise DegenerateAlignmentError(f"no covariance without an estimate: {result.message}")
    seen, free = _split_motions(result)
    x = to_xytheta(result.T_target_source)
    pairs = _line_pairs(result.correspondences, result.target, x, seen)
    in_cloud = is_cloud(result.target.search.grid, noise)
    if in_cloud and _held_share(result, pairs, x, seen) < MIN_HELD_SHARE:
        raise DegenerateAlignmentError(
            "no covariance: the scan finds partners as near wherever it lies; "
            "points so dense need longer surfaces, or less noise"
        )
    by_ranges = _range_pulls(pairs, noise, result.target)
    pulls = _line_pulls(pairs)
    net_pull = pulls.sum(axis=0)
    if result.parameters.metric == "point_to_point":
        pulls = pulls + _pulls_along_surfaces(pairs, x, seen)
    stretch, _ = _share_cells(pairs.target, MAX_NEIGHBOR_DISTANCE)
    by_stretch = _sum_by(stretch, pulls)
    spread = by_ranges.T @ by_ranges
    spread += _positive_part(by_stretch.T @ by_stretch - spread) + np.outer(net_pull, net_pull)
    gain = np.linalg.inv(_hessian(pairs))
    return gain @ spread @ gain.T, seen, free


def _line_pairs(
    pairs: Correspondences, target: Target, x: FloatArray, seen: FloatArray
) -> _LinePairs:
    """Those of the pairs at a motion x, (3,), that are kept and lie on a surface."""
    normals = target.normals[pairs.target_index]
    used = pairs.kept & np.isfinite(normals[:, 0])
    p = pairs.source[used]
    q = pairs.target[used]
    n = normals[used]
    scanner = (x[0], x[1])
    return _LinePairs(
        source=p,
        arm=p - scanner,
        target=q,
        target_index=pairs.target_index[used],
        normals=n,
        weights=pairs.weights[used],
        residuals=line_residuals(p, q, n),
        slope=line_rows(p, n, scanner, 1.0) @ seen,
        seen_turn=seen[2],
    )


def _nearest_pairs(result: _Result, x: FloatArray, seen: FloatArray) -> _LinePairs:
    """The pairs that are nearest at another motion x, (3,)."""
    pairs = pairs_at(result.source, result.target, from_xytheta(x), result.parameters)
    return _line_pairs(pairs, result.target, x, seen)


def _held_share(result: _Result, pairs: _LinePairs, x: FloatArray, seen: FloatArray) -> float:
    """Share of the pull of fixed pairs that is left if each point takes its nearest partner anew.

    The scan moves by its residuals' size to either side in each direction that is seen; the
    smallest share counts. A point in a cloud has a partner near by wherever the scan lies.
    """
    rms = math.sqrt(np.average(pairs.residuals**2, weights=pairs.weights))
    if rms < 64.0 * EPSILON * np.abs(pairs.source).max():  # rounding
        return 1.0
    shares = []
    for k, direction in enumerate(seen.T):
        slope = pairs.slope[:, k]
        step = rms / math.sqrt(np.average(slope**2, weights=pairs.weights))
        of_fixed, of_nearest = 0.0, 0.0
        for side in (step, -step):
            residuals = pairs.residuals + side * slope
            weights = weights_of(np.abs(residuals), result.parameters.huber_delta)
            of_fixed += side * np.sum(weights * residuals * slope)
            nearest = _nearest_pairs(result, x + side * direction, seen)
            of_nearest += side * np.sum(nearest.weights * nearest.residuals * nearest.slope[:, k])
        if of_fixed > 0.0:  # it is 0 where all residuals lie beyond δ
            shares.append(of_nearest / of_fixed)
    return min(shares, default=1.0)


def _hessian(pairs: _LinePairs) -> FloatArray:
    """A = ∂²J/∂x² in the seen directions, shape (S, S)."""
    w, r = pairs.weights, pairs.residuals
    A = (pairs.slope * w[:, None]).T @ pairs.slope
    # ∂²r/∂ψ² = −n·R p; its mean is left out, because Σ w r n = 0 at the minimum.
    bend = np.sum(w * r * _dot(pairs.normals, pairs.arm - pairs.arm.mean(axis=0)))
    return np.asarray(2.0 * (A - bend * np.outer(pairs.seen_turn, pairs.seen_turn)))


def _range_pulls(pairs: _LinePairs, range_std: float, target: Target) -> FloatArray:
    """Rows whose squares sum up to B cov(z) Bᵀ: the gradient ∂J/∂x by each range, times its std."""
    w, n, r = pairs.weights, pairs.normals, pairs.residuals
    source_ray = pairs.arm / _ranges(pairs.arm)  # the beams, as unit vectors
    target_ray = pairs.target / _ranges(pairs.target)
    r_by_source_range = _dot(n, source_ray)  # ∂r/∂z
    r_by_target_range = -_dot(n, target_ray)

    B_source = pairs.slope * r_by_source_range[:, None]
    B_source += np.outer(r * _dot(n, _perpendicular(source_ray)), pairs.seen_turn)
    neighborhood, size = _neighborhoods(target)  # one range of the target may serve many pairs
    rows = w[:, None] * pairs.slope * r_by_target_range[:, None]
    B_target = _sum_by(neighborhood[pairs.target_index], rows, len(size))
    B_target /= np.sqrt(size)[:, None]  # all ranges of a neighbourhood serve its pairs alike
    return 2.0 * range_std * np.vstack([w[:, None] * B_source, B_target])


def _line_pulls(pairs: _LinePairs) -> FloatArray:
    """Gradients of w r² with respect to x, shape (N, S)."""
    return 2.0 * (pairs.weights * pairs.residuals)[:, None] * pairs.slope


def _pulls_along_surfaces(pairs: _LinePairs, x: FloatArray, seen: FloatArray) -> FloatArray:
    """Gradients of w (τ·(R p + t − q))² with respect to x, (N, S); τ runs along the surface."""
    tangents = _perpendicular(pairs.normals)
    slope = line_rows(pairs.source, tangents, (x[0], x[1]), 1.0) @ seen
    residuals = line_residuals(pairs.source, pairs.target, tangents)
    return np.asarray(2.0 * (pairs.weights * residuals)[:, None] * slope)


def _neighborhoods(target: Target) -> tuple[IntArray, IntArray]:
    """Neighbourhood of each target point, shape (M,), and how many points each of them holds.

    Dense points lie on lines through all points within `line_width`, which share their noise.
    """
    if not target.dense:
        return np.arange(len(target.points)), np.ones(len(target.points), np.intp)
    return _share_cells(target.points, target.line_width)


def _share_cells(points: FloatArray, side: float) -> tuple[IntArray, IntArray]:
    """Number of the square cell of each point, cells of this side [m], and the points of each."""
    column, line = np.floor(points / side).T
    cells = column + 1j * line
    _, cell, size = np.unique(cells, return_inverse=True, return_counts=True)
    return cell, size


def _sum_by(group: IntArray, rows: FloatArray, count: int = 0) -> FloatArray:
    """Sums of the rows of each group, shape (G, S)."""
    sums = np.zeros((max(count, group.max(initial=-1) + 1), rows.shape[1]))
    np.add.at(sums, group, rows)
    return sums


def _positive_part(M: FloatArray) -> FloatArray:
    """A symmetric matrix without its negative eigenvalues."""
    values, vectors = np.linalg.eigh(M)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _check_result(result: object) -> None:
    if not isinstance(result, _Result):
        problem = f"must be of the class IcpResult, got {result!r:.80}"
        raise InvalidParameterError(problem, parameter="result")


def _split_motions(result: _Result) -> tuple[FloatArray, FloatArray]:
    """Bases of the motions (Δx, Δy, Δψ) that the pairs see, (3, S), and leave free, (3, F).

    The mean sin² of the angle between the normals of the two scans is noise, so a direction with
    no more information than that is free, too.
    """
    pairs, T = result.correspondences, result.T_target_source
    normals = estimate_normals(result.source)[:: pairs.stride] @ T[:2, :2].T
    information = observability(pairs, result.target, normals)
    if information is None:
        raise DegenerateAlignmentError("no covariance: no pair lies on a surface")
    cosines = _dot(normals, result.target.normals[pairs.target_index])
    used = pairs.kept & np.isfinite(cosines)
    normal_noise = np.average(1.0 - cosines[used] ** 2, weights=pairs.weights[used])
    is_free = information.values < MIN_INFORMATION + normal_noise

    x, y = information.center - T[:2, 2]
    to_motion = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])  # from (Δx, Δy, ℓΔψ)
    to_motion[:, 2] /= information.length
    motions = to_motion @ information.vectors
    seen = motions[:, ~is_free]
    directions = [v / np.linalg.norm(v) for v in motions[:, is_free].T]
    match = result.source, result.target, T, result.parameters
    free = [follow_surfaces(*match, seen, direction) for direction in directions]
    return seen, np.reshape(free, (-1, 3)).T


def _ranges(points: FloatArray) -> FloatArray:
    """Distance of each point from its scanner, shape (N, 1), never 0: no beam ends there."""
    return np.maximum(np.hypot(points[:, :1], points[:, 1:]), np.finfo(float).tiny)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Row by row a·b."""
    return np.asarray((a * b).sum(axis=1))


def _perpendicular(v: FloatArray) -> FloatArray:
    """Each row (x, y) turned by a right angle to the left: (−y, x)."""
    return np.column_stack([-v[:, 1], v[:, 0]])
