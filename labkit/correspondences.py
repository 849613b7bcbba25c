"""Correspondences: pairs of source and target points, and which of them to believe (section 4).

Each box of the lesson's flow chart is one function. Their result is `Correspondences`:

=============  =================================================================
D  associate   the nearest target point of each source point
E  reject      `gate_mask` (A) and `overlap_mask` (B)
E  weigh       `weights_of` (C)
=============  =================================================================

Residuals, gate and delta are distances in metres, never squares. `distance_gate`, `overlap`,
`huber_weights` and `huber_loss` check what a caller hands over, and call the same functions.

References
----------
.. [1] Chetverikov, Svirko, Stepanov, Krsek, "The trimmed iterative closest point
       algorithm", ICPR 2002.
.. [2] Huber, "Robust estimation of a location parameter", Ann. Math. Stat. 35(1), 1964.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from labkit.neighbors import (
    ROUNDING_MARGIN,
    Grid,
    Search,
    nearest,
    start_search,
)
from labkit.parameters import IcpParameters
from labkit.scan import Scan, as_scan
from labkit.schedule import Stage, adapt_delta, stage_of
from labkit.selection import kth_smallest
from labkit.support.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    as_floats,
    as_transform,
    check_kind,
    check_range,
    read_only,
)
from labkit.support.compiled import compiled
from labkit.support.errors import InvalidPointsError
from labkit.target import Target, as_target

MIN_PAIRS = 3  # the fewest pairs a step is computed from, as in the lesson


class Correspondences(NamedTuple):
    """The pairs of one association, and what each stage decided about them.

    Entry i is point i of ``source[::stride]``; only coarse iterations have a stride above 1.
    """

    source: FloatArray  #: The source points in the target's frame [m], shape (N, 2).
    target: FloatArray  #: The nearest target point of each [m], shape (N, 2).
    normals: FloatArray  #: The target's normal there or NaN; (0, 2) under point-to-point.
    target_index: IntArray  #: Row of the nearest point in the target, shape (N,).
    distances: FloatArray  #: Distance between the two points of each pair [m], shape (N,).
    residuals: FloatArray  #: The distance [m], or that from the line; NaN without a normal.
    within_overlap: BoolArray  #: Which are among the ⌊ρN⌋ closest pairs, shape (N,).
    weights: FloatArray  #: Huber's weight of a kept pair, 0 for a rejected one, shape (N,).
    inlier_count: int  #: Number of kept pairs.
    max_correspondence_distance: float  #: The gate d_max [m] of this iteration.
    huber_delta: float  #: δ [m] of this iteration.
    point_share: float  #: Share of the point-to-point metric in the step of line pairs.
    stride: int  #: Only the points ``source[::stride]`` were matched.

    def __reduce__(self) -> tuple[Any, ...]:
        """Make the pairs anew where they are unpickled: their arrays are read-only there, too."""
        return _read_only_pairs, tuple(self)

    @property
    def kept(self) -> BoolArray:
        """Mask of the pairs that passed the gate, are among the ⌊ρN⌋ closest, have a residual."""
        return self.weights > 0.0

    @property
    def within_gate(self) -> BoolArray:
        """Mask of the pairs that passed the gate, shape (N,)."""
        return self.distances <= self.max_correspondence_distance

    @property
    def cost(self) -> float:
        """The truncated Huber cost J [m²]; see `labkit.icp`."""
        return cost(self)

    @property
    def fitness(self) -> float:
        """Kept pairs over source points, in [0, 1]."""
        return self.inlier_count / len(self.kept)

    @property
    def inlier_rmse(self) -> float:
        """Root mean square distance [m] of the kept pairs; NaN where none was kept."""
        return math.sqrt(np.mean(self.distances[self.kept] ** 2)) if self.kept.any() else math.nan


@compiled
def associate(
    source: FloatArray, target: Search, T: FloatArray, max_distance: float
) -> tuple[FloatArray, IntArray, FloatArray]:
    """(D) Move source points (N, 2) by T and find the nearest target point of each.

    Returns the moved points, and row and distance [m] of their partners; −1 and inf where none
    lies within `max_distance` [m].
    """
    moved = np.empty(source.shape)
    for i in range(len(source)):
        x, y = source[i, 0], source[i, 1]
        moved[i, 0] = T[0, 0] * x + T[0, 1] * y + T[0, 2]
        moved[i, 1] = T[1, 0] * x + T[1, 1] * y + T[1, 2]
    index, distances = nearest(moved, target, ROUNDING_MARGIN * max_distance)
    return moved, index, distances


@compiled
def reject_and_weigh(
    source: FloatArray,
    index: IntArray,
    distances: FloatArray,
    target: FloatArray,
    normals: FloatArray,
    stage: Stage,
) -> Correspondences:
    """(E) Weigh the pairs: 0 beyond the gate or the overlap, else Huber's weight."""
    partners = np.empty(source.shape)
    for i in range(len(source)):
        partners[i, 0] = target[index[i], 0]
        partners[i, 1] = target[index[i], 1]

    residuals = distances.copy()
    partner_normals = np.empty((len(source) if len(normals) > 0 else 0, 2))
    for i in range(len(partner_normals)):
        nx, ny = normals[index[i], 0], normals[index[i], 1]
        dx, dy = source[i, 0] - partners[i, 0], source[i, 1] - partners[i, 1]
        partner_normals[i, 0] = nx
        partner_normals[i, 1] = ny
        residuals[i] = abs(nx * dx + ny * dy)  # |n·(p − q)|

    within_gate = gate_mask(distances, stage.max_correspondence_distance)  # (A)
    within_overlap = overlap_mask(distances, stage.overlap_ratio)  # (B)
    kept = within_gate & within_overlap & np.isfinite(residuals)
    huber_delta, point_share = adapt_delta(residuals, kept, stage)
    weights = kept * weights_of(residuals, huber_delta)  # (C)
    return Correspondences(
        source,
        partners,
        partner_normals,
        index,
        distances,
        residuals,
        within_overlap,
        weights,
        kept.sum(),
        stage.max_correspondence_distance,
        huber_delta,
        point_share,
        stage.stride,
    )


@compiled
def gate_mask(distances: FloatArray, max_correspondence_distance: float) -> BoolArray:
    """(A) Mask of the pairs within the gate: ``d <= max_correspondence_distance`` [m]."""
    return distances <= max_correspondence_distance


@compiled
def overlap_mask(distances: FloatArray, overlap_ratio: float) -> BoolArray:
    """(B) Mask of the ⌊ρN⌋ closest pairs, at least 3; of equally close ones the first."""
    count = overlap_count(len(distances), overlap_ratio)
    kept = np.ones(len(distances), np.bool_)
    if count == len(distances):
        return kept
    largest = kth_smallest(distances, count - 1)
    ties = count  # pairs at the largest kept distance that are still to be kept
    for i in range(len(distances)):
        kept[i] = distances[i] < largest
        ties -= kept[i]
    for i in range(len(distances)):
        if ties > 0 and distances[i] == largest:
            kept[i] = True
            ties -= 1
    return kept


@compiled
def overlap_count(source_points: int, overlap_ratio: float) -> int:
    """Number of pairs that the overlap keeps: ⌊ρN⌋, the product a double; at least 3 if it can."""
    return min(source_points, max(MIN_PAIRS, int(overlap_ratio * source_points)))


@compiled
def weights_of(residuals: FloatArray, huber_delta: float) -> FloatArray:
    """(C) Huber's weights of residuals [m], shape (N,): 1 up to δ, δ/r beyond."""
    weights = np.ones(len(residuals))
    for i in range(len(residuals)):
        if residuals[i] > huber_delta:
            weights[i] = huber_delta / residuals[i]
    return weights


@compiled
def cost(pairs: Correspondences) -> float:
    """The truncated Huber cost J [m²] of the ⌊ρN⌋ closest pairs, over N (4.1).

    A pair outside the gate counts as if it lay at the gate; one without a normal, by its
    distance.
    """
    gate = pairs.max_correspondence_distance
    total = 0.0
    for i in range(len(pairs.distances)):
        if pairs.within_overlap[i]:
            r = min(pairs.distances[i], gate)
            if pairs.distances[i] <= gate and math.isfinite(pairs.residuals[i]):
                r = pairs.residuals[i]
            total += loss_of(r, pairs.huber_delta)
    return total / len(pairs.distances)


@compiled
def loss_of(residual: float, huber_delta: float) -> float:
    """Huber's loss [m²] of a residual [m]: r² up to δ, 2δr − δ² beyond."""
    capped = min(residual, huber_delta)
    return capped * (2.0 * residual - capped)


def distance_gate(distances: ArrayLike, max_correspondence_distance: float) -> BoolArray:
    """(A) Mask of the pairs within the gate: ``d <= max_correspondence_distance`` [m]."""
    name = "max_correspondence_distance"
    gate = check_range(max_correspondence_distance, name, above=0.0, unit="m")
    d = _as_distances(distances, "distances")
    return gate_mask(d.ravel(), gate).reshape(d.shape)


def overlap(distances: ArrayLike, overlap_ratio: float) -> BoolArray:
    """(B) Mask of the ⌊ρN⌋ closest pairs, at least 3; of equally close ones the first.

    The distances [m], shape (N,), are those of *all* N source points, gated or not. So the order
    of gate and overlap does not matter, and ρ in (0, 1] stays a share of the source.
    """
    ratio = check_range(overlap_ratio, "overlap_ratio", above=0.0, at_most=1.0)
    return overlap_mask(_as_distances(distances, "distances").ravel(), ratio)


def huber_weights(residuals: ArrayLike, huber_delta: float) -> FloatArray:
    """(C) Huber's weights of residuals [m]: 1 up to δ, δ/r beyond; all 1 where δ is inf."""
    delta = check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    r = _as_distances(residuals, "residuals")
    return weights_of(r.ravel(), delta).reshape(r.shape)


def huber_loss(residuals: ArrayLike, huber_delta: float) -> FloatArray:
    """Huber's loss [m²] whose weights those are: r² up to δ, 2δr − δ² beyond."""
    delta = check_range(huber_delta, "huber_delta", above=0.0, unit="m")
    r = _as_distances(residuals, "residuals")
    return losses_of(r.ravel(), delta).reshape(r.shape)


@compiled
def losses_of(residuals: FloatArray, huber_delta: float) -> FloatArray:
    """Huber's loss [m²] of each residual [m], shape (N,)."""
    losses = np.empty(len(residuals))
    for i in range(len(residuals)):
        losses[i] = loss_of(residuals[i], huber_delta)
    return losses


def _as_distances(values: ArrayLike, name: str) -> FloatArray:
    """Check distances [m]: none is negative or NaN."""
    checked = as_floats(values, name, hint="give distances in metres")
    wrong = np.argwhere(~(checked >= 0.0))
    if wrong.size:
        where = tuple(wrong[0].tolist())
        raise InvalidPointsError(
            f"`{name}` must be distances, not negative, got {checked[where]} at index "
            f"{', '.join(map(str, where)) or 0}"
        )
    return checked


def pairs_at(
    source: Scan | ArrayLike,
    target: Target | Scan | ArrayLike,
    T_target_source: ArrayLike,
    parameters: IcpParameters,
    *,
    coarse: bool = False,
) -> Correspondences:
    """Boxes D and E together, at a pose of a fine or a `coarse` iteration.

    All partners are looked for, however far; the arrays are read-only.
    """
    check_kind(parameters, "parameters", IcpParameters)
    check_kind(coarse, "coarse", bool)
    points = as_scan(source, "source", minimum=1).points
    target = as_target(target)
    T = as_transform(T_target_source, "T_target_source")
    normals = target.normals_for(parameters)
    return _read_only_pairs(*_pairs_at(points, target.search.grid, normals, T, parameters, coarse))


def _read_only_pairs(*values: Any) -> Correspondences:
    for value in values:
        if isinstance(value, np.ndarray):
            read_only(value)
    return Correspondences(*values)


@compiled
def _pairs_at(
    source: FloatArray,
    target: Grid,
    normals: FloatArray,
    T: FloatArray,
    parameters: IcpParameters,
    coarse: bool,
) -> tuple[Any, ...]:
    stage = stage_of(parameters, len(source), coarse, 0)
    search = start_search(target, len(source))
    found = associate(source[:: stage.stride], search, T, math.inf)
    pairs = reject_and_weigh(*found, target.points, normals, stage)
    return pairs[:]  # as a plain tuple, for Python
