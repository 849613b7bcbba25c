"""Edges that a case must not sit on, because two correct programs could differ there.

A decision is one comparison: which neighbour is nearer, which pair is trimmed, inside the
gate or not, degenerate or not, converged or not. Along the whole history of a run, every
decision must stand clear of its limit by far more than rounding can move it. What no
single comparison shows, a jitter of the inputs does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from cases import Case, Content
from compare import disagreement
from labkit import IcpParameters, IcpResult
from labkit.alignment import RELATIVE_RESOLUTION
from labkit.arrays import FloatArray
from labkit.correspondences import Correspondences, overlap_count
from reference import Files, answer, pairs, run

DISTANCE_GAP = 1e-9  # m; rounding moves a distance by about 1e-14 m
TOLERANCE_GAP = 0.01  # of a tolerance
DEGENERACY_FACTOR = 4.0  # above or below a threshold of degeneracy
JITTER = 1e-13  # of each input number
JITTER_POSE = 1e-10  # how far that may move an answer


class OnAnEdgeError(ValueError):
    """Two correct programs could answer this case differently."""


def refuse_edges(case: Case, files: Files) -> None:
    """Raise `OnAnEdgeError`, naming the case and the edge, where it sits on one."""
    for edge in _edges(case, files):
        raise OnAnEdgeError(f"{case.name}: {edge}")


def _edges(case: Case, files: Files) -> Iterator[str]:
    if case.command[0] == "align":
        yield from alignment_edges(*pairs(files, case.command[1]))
    if case.command[0] == "match":
        yield from run_edges(
            run(case.command, files), np.array(files[case.command[1]]), _limits(case, files)
        )
    yield from jitter_edges(case, files)


def _limits(case: Case, files: Files) -> IcpParameters:
    told: dict[str, Any] = dict(files[case.command[3]])  # type: ignore[arg-type]
    known = {k: v for k, v in told.items() if not k.startswith("initial_")}
    return IcpParameters(**{k: math.inf if v is None else v for k, v in known.items()})


def run_edges(result: IcpResult, target: FloatArray, limits: IcpParameters) -> Iterator[str]:
    """The edges that a run touches, from the guess to its last association."""
    for number, state in enumerate(result.history):
        for edge in association_edges(state.correspondences, target, limits.overlap_ratio):
            yield f"at iteration {number}, {edge}"
        kept = state.correspondences.kept
        if np.count_nonzero(kept) >= 3:
            c = state.correspondences
            yield from alignment_edges(c.source[kept], c.target[kept], c.weights[kept])
    for before, now in pairwise(result.history):
        for name, value, limit in (
            ("translation step", now.translation_step, limits.translation_tolerance),
            ("rotation step", now.rotation_step, limits.rotation_tolerance),
            ("cost change", abs(now.cost - before.cost), limits.cost_tolerance),
        ):
            if limit > 0.0 and abs(value - limit) < TOLERANCE_GAP * limit:
                yield f"a {name} of {value:.6g} stands beside its tolerance {limit:g}"


def association_edges(
    found: Correspondences, target: FloatArray, overlap_ratio: float
) -> Iterator[str]:
    """Ties between neighbours, at the gate, and at the overlap's boundary."""
    apart = np.hypot(*(found.source[:, None] - target[None]).transpose(2, 0, 1))
    if len(target) > 1:
        nearest, second = np.partition(apart, 1, axis=1)[:, :2].T
        if (gap := (second - nearest).min()) < DISTANCE_GAP:
            yield f"two target points are equally near (to {gap:.3g} m)"
    if (gap := np.abs(found.distances - found.gate).min()) < DISTANCE_GAP:
        yield f"a pair stands on the gate (to {gap:.3g} m)"
    ordered = np.sort(found.distances)
    count = overlap_count(len(ordered), overlap_ratio)
    if count < len(ordered) and (gap := ordered[count] - ordered[count - 1]) < DISTANCE_GAP:
        yield f"two pairs meet at the overlap's boundary (to {gap:.3g} m)"


def alignment_edges(p: FloatArray, q: FloatArray, w: FloatArray | None) -> Iterator[str]:
    """Thresholds of degeneracy within a factor of four."""
    w = np.ones(len(p)) if w is None else w
    if w.sum() == 0.0:
        return
    p, q, w = p[w > 0.0], q[w > 0.0], w[w > 0.0]
    x, y = (points - w @ points / w.sum() for points in (p, q))
    spread = [math.sqrt(w @ (z * z).sum(axis=1) / w.sum()) for z in (x, y)]
    for name, points, centered, size in zip(
        ("source", "target"), (p, q), (x, y), spread, strict=True
    ):
        rounding = 64.0 * np.finfo(float).eps * np.abs(points).max()
        limit = max(rounding, RELATIVE_RESOLUTION * np.abs(centered).max())
        yield from _threshold(f"the spread of the {name}", size, limit)
    a = w @ (x * y).sum(axis=1)
    b = w @ (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0])
    limit = RELATIVE_RESOLUTION * w.sum() * spread[0] * spread[1]
    if min(spread) > 0.0:
        yield from _threshold("the strength of the rotation", math.hypot(a, b), limit)


def _threshold(name: str, value: float, limit: float) -> Iterator[str]:
    if limit / DEGENERACY_FACTOR < value < limit * DEGENERACY_FACTOR:
        yield f"{name}, {value:.3g}, stands beside its threshold {limit:.3g}"


def jitter_edges(case: Case, files: Files) -> Iterator[str]:
    """A difference that a jitter of the inputs makes.

    What is degenerate is left out: a jitter takes points apart that coincide, and the
    thresholds have been looked at.
    """
    expected = answer(case.command, files)
    if "degenerate" in (expected.get("error"), expected.get("termination")):
        return
    for seed in range(3):
        rng = np.random.default_rng(seed)
        shaken = {path: _shake(files[path], rng) for path in case.command if path in files}
        reason = disagreement(answer(case.command, shaken), expected, JITTER_POSE)
        if reason:
            yield f"a relative jitter of {JITTER:g} changes it: {reason}"


def _shake(content: Content, rng: np.random.Generator) -> Content:
    if isinstance(content, dict):
        return content
    rows = np.array(content)
    shaken: list[list[float]] = (
        rows * (1.0 + JITTER * rng.uniform(-1.0, 1.0, rows.shape))
    ).tolist()
    return shaken
