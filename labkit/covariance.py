"""How far to trust a match: Censi's closed-form covariance (section 5).

The estimate x = (Δx, Δy, Δψ) minimises a cost J(x, z) of the measured ranges z. Where the
gradient ∂J/∂x vanishes, the implicit function theorem tells how x follows z, so

    cov(x) ≈ A⁻¹ B cov(z) Bᵀ A⁻¹ ,   A = ∂²J/∂x² ,   B = ∂²J/∂z ∂x               (6.4)

J is the point-to-line cost Σ wᵢ rᵢ², rᵢ = nᵢ·(R pᵢ + t − qᵢ), with the correspondences,
normals and weights of the last association held fixed. Three things are added to [1]:

- A free direction of the motion has no finite variance, or that of the prior.
- Surfaces are rougher than the ranges' noise alone: where the residuals are larger than
  cov(z) explains, cov(z) grows with them.
- The point-to-point metric pulls along the surfaces as well. These pulls do not hold the
  scan, because the pairs change when it slides. So they count as noise, the same for all
  pairs of a surface.

References
----------
.. [1] Censi, "An accurate closed-form estimate of ICP's covariance", ICRA 2007.
.. [2] Bonnabel, Barczyk, Goulette, "On the covariance of ICP-based scan-matching
       techniques", ACC 2016 (why fixed pairs do for lines, and not for points).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FloatArray, IntArray, as_floats, check_range
from labkit.degeneracy import observability
from labkit.errors import DegenerateAlignmentError, InvalidPointsError
from labkit.line_alignment import MIN_INFORMATION
from labkit.normals import estimate_normals
from labkit.result import IcpResult
from labkit.se2 import apply

ALONG_AN_AXIS = 0.05  # share of a free direction below which an axis is not part of it
ONE_SURFACE = math.cos(math.radians(20.0)), 0.5  # turn and gap [m] that end a surface


def censi_covariance(
    result: IcpResult, range_std: float, prior_covariance: ArrayLike | None = None
) -> FloatArray:
    """Covariance of an estimated motion, from the noise of the ranges.

    Parameters
    ----------
    result : IcpResult
        What `labkit.icp` returned.
    range_std : float
        Standard deviation of one range of either scan [m]. It is a lower bound: the
        residuals may show more noise.
    prior_covariance : array_like, shape (3, 3), optional
        Covariance of the prior from which the match began: wheels, or an IMU. Where the
        ranges say nothing, the estimate is the prior's; elsewhere the two are fused.

    Returns
    -------
    ndarray, shape (3, 3)
        Covariance of (Δx, Δy, Δψ), in m², m rad and rad². Without a prior it is infinite
        along free directions: there the ranges say nothing, however small the formula's
        number. An axis that leans towards a free direction by more than 3° counts as free.

    Raises
    ------
    InvalidPointsError
        For a prior's covariance that is not symmetric and positive definite.
    DegenerateAlignmentError
        Where the match failed, or no pair lies on a surface.

    Notes
    -----
    The formula knows one minimum, and cannot know whether it is the right one. If the points
    lie closer together than the noise is wide, the noise chooses the partners, and the
    covariance is too small (by a fifth in the standard deviation at 541 beams with
    30 mm of noise).
    """
    check_range(range_std, "range_std", above=0.0, unit="m")
    if result.termination.failed:
        raise DegenerateAlignmentError(f"no covariance without an estimate: {result.message}")
    seen, free = _seen_and_free(result)
    pairs = _Pairs.of(result)
    noise = range_std**2 * max(1.0, pairs.roughness(range_std)) * pairs.gradient_noise()
    if result.parameters.metric == "point_to_point":
        noise += pairs.slip()
    gain = seen @ np.linalg.inv(seen.T @ pairs.stiffness() @ seen) @ seen.T  # A⁻¹ where seen
    covariance: FloatArray = gain @ noise @ gain.T
    if prior_covariance is not None:
        return _fused(covariance, seen, free, _as_covariance(prior_covariance))
    for direction in free.T:
        moved = np.where(np.abs(direction) > ALONG_AN_AXIS, np.sign(direction), 0.0)
        along = np.outer(moved, moved)
        covariance[along != 0.0] = math.inf * along[along != 0.0]
    return covariance


@dataclass(frozen=True, eq=False, kw_only=True)
class _Pairs:
    """The kept pairs that lie on surfaces, in the target's frame.

    Attributes
    ----------
    target_index : ndarray, shape (P,)
        Which target point each has; several may share one.
    w, r : ndarray, shape (P,)
        Weight, and residual across the surface [m].
    q, n : ndarray, shape (P, 2)
        Target point [m] and its normal.
    turned, offset : ndarray, shape (P, 2)
        R p, and R p + t − q [m].
    """

    target_index: IntArray
    w: FloatArray
    r: FloatArray
    q: FloatArray
    n: FloatArray
    turned: FloatArray
    offset: FloatArray

    @classmethod
    def of(cls, result: IcpResult) -> _Pairs:
        target, pairs, T = result.target, result.correspondences, result.T_target_source
        used = pairs.kept & np.isfinite(target.normals[pairs.target_index, 0])
        index = pairs.target_index[used]
        p = result.source.points[:: pairs.stride][used]
        q, n = target.points[index], target.normals[index]
        offset = apply(T, p) - q
        return cls(
            target_index=index,
            w=pairs.weights[used],
            r=_dot(n, offset),
            q=q,
            n=n,
            turned=p @ T[:2, :2].T,
            offset=offset,
        )

    @property
    def rays(self) -> tuple[FloatArray, FloatArray]:
        """The beams' directions u at the source points (p = ρ u) and at the target points."""
        return self.turned / _ranges(self.turned), self.q / _ranges(self.q)

    def slope(self, direction: FloatArray) -> FloatArray:
        """How far a motion (Δx, Δy, Δψ) moves each source point along `direction`, (P, 3)."""
        return np.column_stack([direction, _dot(direction, _perpendicular(self.turned))])

    def stiffness(self) -> FloatArray:
        """A = ∂²J/∂x², (3, 3)."""
        slope = self.slope(self.n)
        A: FloatArray = 2.0 * (slope * self.w[:, None]).T @ slope
        A[2, 2] -= 2.0 * np.sum(self.w * self.r * _dot(self.n, self.turned))  # ∂²r/∂ψ² = −n·R p
        return A

    def gradient_noise(self) -> FloatArray:
        """B Bᵀ, (3, 3): how the gradient of J spreads with ranges of unit noise."""
        ray, target_ray = self.rays
        slope = self.slope(self.n)
        B_source = slope * _dot(self.n, ray)[:, None]
        B_source[:, 2] += self.r * _dot(self.n, _perpendicular(ray))
        B_pairs = -slope * _dot(self.n, target_ray)[:, None]
        B_target = np.zeros((int(self.target_index.max()) + 1, 3))
        # one range may serve many pairs
        np.add.at(B_target, self.target_index, self.w[:, None] * B_pairs)
        B = 2.0 * np.vstack([self.w[:, None] * B_source, B_target])
        spread: FloatArray = B.T @ B
        return spread

    def roughness(self, range_std: float) -> float:
        """Mean square of the residuals over that which ranges of this noise would leave."""
        ray, target_ray = self.rays
        of_noise = _dot(self.n, ray) ** 2 + _dot(self.n, target_ray) ** 2
        expected = range_std**2 * float(self.w @ of_noise)
        return float(self.w @ self.r**2) / expected if expected > 0.0 else math.inf

    def slip(self) -> FloatArray:
        """How the gradient spreads with what pulls along the surfaces, (3, 3).

        Neighbours on a surface are pulled alike, so a surface's pulls are added up first.
        """
        along = _perpendicular(self.n)
        pull = 2.0 * self.slope(along) * (self.w * _dot(along, self.offset))[:, None]
        straight, gap = ONE_SURFACE
        bent = np.abs(_dot(self.n[1:], self.n[:-1])) < straight
        apart = np.hypot(*np.diff(self.q, axis=0).T) > gap
        surface = np.concatenate([[0], np.cumsum(bent | apart)])
        of_surface = np.zeros((surface[-1] + 1, 3))
        np.add.at(of_surface, surface, pull)
        spread: FloatArray = of_surface.T @ of_surface
        return spread


def _seen_and_free(result: IcpResult) -> tuple[FloatArray, FloatArray]:
    """Bases of the motions (Δx, Δy, Δψ) that the pairs see and of those left free, (3, ·).

    A free motion changes no residual; seen are those that leave the free ones at rest in the
    units of `labkit.line_alignment.Information`, where a turn counts by how far it moves.
    """
    pairs, T = result.correspondences, result.T_target_source
    normals = estimate_normals(result.source)[:: pairs.stride] @ T[:2, :2].T
    information = observability(pairs, result.target, normals)
    if information is None:
        raise DegenerateAlignmentError("no covariance: no pair lies on a surface")
    x, y = information.center - T[:2, 2]
    to_motion = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    motions = to_motion @ (information.vectors / [[1.0], [1.0], [information.length]])
    is_free = information.values < MIN_INFORMATION + _stagger(result, normals)
    free = motions[:, is_free]
    return motions[:, ~is_free], free / np.linalg.norm(free, axis=0)


def _stagger(result: IcpResult, normals: FloatArray) -> float:
    """Mean sin² of the normals' own noise: half of that between the two scans' normals.

    Structure below it is not told from noise: pairs are chosen by noise as well, so that
    their normals are not quite independent.
    """
    pairs = result.correspondences
    cosines = _dot(normals, result.target.normals[pairs.target_index])
    used = pairs.kept & np.isfinite(cosines)
    w = pairs.weights[used]
    return float(w @ (1.0 - cosines[used] ** 2) / w.sum()) / 2.0


def _fused(
    covariance: FloatArray, seen: FloatArray, free: FloatArray, prior: FloatArray
) -> FloatArray:
    """What match and prior say together: their information adds, the match's where it sees."""
    basis = np.column_stack([seen, free])
    coordinates = np.linalg.inv(basis)[: seen.shape[1]]  # of a motion along the seen ones
    measured = coordinates @ covariance @ coordinates.T
    information = coordinates.T @ np.linalg.solve(measured, coordinates) + np.linalg.inv(prior)
    fused: FloatArray = np.linalg.inv(information)
    return fused


def _as_covariance(values: ArrayLike) -> FloatArray:
    """Check a (3, 3) covariance."""
    C = as_floats(values, "prior_covariance", hint="give a (3, 3) array")
    if C.shape != (3, 3) or not np.isfinite(C).all():
        raise InvalidPointsError(
            f"`prior_covariance` must be finite and of shape (3, 3), got shape {C.shape}"
        )
    if not np.allclose(C, C.T, rtol=1e-9, atol=0.0) or np.linalg.eigvalsh(C)[0] <= 0.0:
        raise InvalidPointsError(
            f"`prior_covariance` must be symmetric and positive definite, got {C.tolist()}"
        )
    return C


def _ranges(points: FloatArray) -> FloatArray:
    """Distance of each point from its scanner, shape (N, 1), never 0: no beam ends there."""
    return np.maximum(np.hypot(points[:, :1], points[:, 1:]), np.finfo(float).tiny)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Row by row a·b."""
    product: FloatArray = (a * b).sum(axis=1)
    return product


def _perpendicular(v: FloatArray) -> FloatArray:
    """Each row (x, y) turned by a right angle to the left: (−y, x)."""
    return np.column_stack([-v[:, 1], v[:, 0]])
