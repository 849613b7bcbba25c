"""The step from matched pairs, box F: `labkit.alignment` and `labkit.line_alignment`, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.alignment import RELATIVE_RESOLUTION
from labkit.arrays import EPSILON, FloatArray
from labkit.engine.jit import compiled
from labkit.engine.pairs import Pairs
from labkit.line_alignment import (
    BUT_FOR_ROUNDING,
    MIN_INFORMATION,
    STEADY_INFORMATION,
    STEADY_SHARE,
)

SWEEPS = 30  # of Jacobi's rotations at most; five are enough


class Step(NamedTuple):
    """A motion: its turn [rad] and its shift [m]; `solved` is false where it is undetermined."""

    turn: float
    x: float
    y: float
    solved: bool


class Equations(NamedTuple):
    """A x = −g with A = [[a, b, c], [b, d, e], [c, e, f]] and g = (u, v, w)."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float
    u: float
    v: float
    w: float


@compiled
def align(pairs: Pairs, target: FloatArray) -> Step:
    """The closed form: Δψ = atan2(b, a), t = q̄ − R p̄ (section 3)."""
    p_x, p_y, row, weight = pairs.x, pairs.y, pairs.row, pairs.weight
    total, px, py, qx, qy = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(row)):
        w, k = weight[i], row[i]
        total += w
        px, py = px + w * p_x[i], py + w * p_y[i]
        qx, qy = qx + w * target[k, 0], qy + w * target[k, 1]
    px, py, qx, qy = px / total, py / total, qx / total, qy / total  # (2.2)
    a, b, p_spread, q_spread = 0.0, 0.0, 0.0, 0.0
    p_most, q_most, p_arm, q_arm = 0.0, 0.0, 0.0, 0.0
    for i in range(len(row)):
        w, k = weight[i], row[i]
        if w > 0.0:
            x, y = p_x[i] - px, p_y[i] - py
            u, v = target[k, 0] - qx, target[k, 1] - qy
            a += w * (x * u + y * v)  # (2.5)
            b += w * (x * v - y * u)  # (2.6)
            p_spread, q_spread = p_spread + w * (x * x + y * y), q_spread + w * (u * u + v * v)
            p_arm, q_arm = max(p_arm, abs(x), abs(y)), max(q_arm, abs(u), abs(v))
            p_most = max(p_most, abs(p_x[i]), abs(p_y[i]))
            q_most = max(q_most, abs(target[k, 0]), abs(target[k, 1]))
    p_spread, q_spread = math.sqrt(p_spread / total), math.sqrt(q_spread / total)
    spread_out = is_spread(p_spread, p_most, p_arm) and is_spread(q_spread, q_most, q_arm)
    if not spread_out or math.hypot(a, b) <= RELATIVE_RESOLUTION * total * p_spread * q_spread:
        return Step(0.0, 0.0, 0.0, False)
    turn = math.atan2(b, a)  # (2.7)
    c, s = math.cos(turn), math.sin(turn)
    return Step(turn, qx - (c * px - s * py), qy - (s * px + c * py), True)  # (2.3)


@compiled
def is_spread(spread: float, most: float, arm: float) -> bool:
    """Whether points do not coincide, given their largest coordinate and lever arm [m]."""
    return spread > max(64.0 * EPSILON * most, RELATIVE_RESOLUTION * arm)


@compiled
def align_to_lines(
    pairs: Pairs, target: FloatArray, normals: FloatArray, point_share: float
) -> Step:
    """One Gauss-Newton step: A x = −g in the directions that the surface fixes (section 6)."""
    total, cx, cy, length = center_and_length(pairs)
    if not length > 0.0:
        return Step(0.0, 0.0, 0.0, False)
    equations = line_equations(pairs, target, normals, cx, cy, length)
    if point_share > 0.0:
        share = point_equations(pairs, target, cx, cy, length, total)
        equations = blend(equations, share, point_share)
    least = MIN_INFORMATION if point_share < STEADY_SHARE else STEADY_INFORMATION
    least = ((1.0 - point_share) * least + point_share) * BUT_FOR_ROUNDING
    dx, dy, turn = solve_constrained(equations, total * least)
    turn /= length
    c, s = math.cos(turn), math.sin(turn)
    return Step(turn, cx + dx - (c * cx - s * cy), cy + dy - (s * cx + c * cy), True)


@compiled
def center_and_length(pairs: Pairs) -> tuple[float, float, float, float]:
    """The total weight, the weighted centroid c [m] and ℓ [m], 0 where the points coincide."""
    p_x, p_y, weight = pairs.x, pairs.y, pairs.weight
    total, cx, cy, most = 0.0, 0.0, 0.0, 0.0
    for i in range(len(weight)):
        w = weight[i]
        if w > 0.0:
            total, cx, cy = total + w, cx + w * p_x[i], cy + w * p_y[i]
            most = max(most, abs(p_x[i]), abs(p_y[i]))
    if total <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    cx, cy, spread = cx / total, cy / total, 0.0
    for i in range(len(weight)):
        x, y = p_x[i] - cx, p_y[i] - cy
        spread += weight[i] * (x * x + y * y)
    length = math.sqrt(spread / total)
    return total, cx, cy, length if length > 64.0 * EPSILON * most else 0.0


@compiled
def line_equations(
    pairs: Pairs, target: FloatArray, normals: FloatArray, cx: float, cy: float, length: float
) -> Equations:
    """A = JᵀWJ and g = JᵀWe of the point-to-line metric, with J = (nx, ny, n·a⊥) (6.1)."""
    p_x, p_y, row, weight, scale = pairs.x, pairs.y, pairs.row, pairs.weight, 1.0 / length
    a, b, c, d, e, f, u, v, w = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(row)):
        k = row[i]
        if weight[i] > 0.0:
            nx, ny = normals[k, 0], normals[k, 1]
            lever = (ny * (p_x[i] - cx) - nx * (p_y[i] - cy)) * scale
            error = nx * (p_x[i] - target[k, 0]) + ny * (p_y[i] - target[k, 1])
            wx, wy, wt = weight[i] * nx, weight[i] * ny, weight[i] * lever
            a, b, c = a + wx * nx, b + wx * ny, c + wx * lever
            d, e, f = d + wy * ny, e + wy * lever, f + wt * lever
            u, v, w = u + wx * error, v + wy * error, w + wt * error
    return Equations(a, b, c, d, e, f, u, v, w)


@compiled
def point_equations(
    pairs: Pairs, target: FloatArray, cx: float, cy: float, length: float, total: float
) -> Equations:
    """The same of the point-to-point metric: about the centroid, A is the total weight times I."""
    p_x, p_y, row, weight, scale = pairs.x, pairs.y, pairs.row, pairs.weight, 1.0 / length
    u, v, w = 0.0, 0.0, 0.0
    for i in range(len(row)):
        k = row[i]
        if weight[i] > 0.0:
            x, y = (p_x[i] - cx) * scale, (p_y[i] - cy) * scale
            off_x, off_y = weight[i] * (p_x[i] - target[k, 0]), weight[i] * (p_y[i] - target[k, 1])
            u, v, w = u + off_x, v + off_y, w + x * off_y - y * off_x
    return Equations(total, 0.0, 0.0, total, 0.0, total, u, v, w)


@compiled
def blend(line: Equations, point: Equations, t: float) -> Equations:
    """(1 − t) of one and t of the other."""
    r = 1.0 - t
    return Equations(
        r * line.a + t * point.a,
        r * line.b + t * point.b,
        r * line.c + t * point.c,
        r * line.d + t * point.d,
        r * line.e + t * point.e,
        r * line.f + t * point.f,
        r * line.u + t * point.u,
        r * line.v + t * point.v,
        r * line.w + t * point.w,
    )


@compiled
def solve_constrained(q: Equations, minimum: float) -> tuple[float, float, float]:
    """Solve A x = −g, in the directions alone whose eigenvalue reaches `minimum`."""
    if exceeds(q, minimum):
        return solve_whole(q)
    values, V = eigen(q)
    x, y, t = 0.0, 0.0, 0.0
    for k in range(3):
        if values[k, k] >= minimum:
            part = -(q.u * V[0, k] + q.v * V[1, k] + q.w * V[2, k]) / values[k, k]
            x, y, t = x + part * V[0, k], y + part * V[1, k], t + part * V[2, k]
    return x, y, t


@compiled
def exceeds(q: Equations, minimum: float) -> bool:
    """Whether A − minimum·I is positive definite (Sylvester): no eigenvalue is smaller."""
    a, d, f = q.a - minimum, q.d - minimum, q.f - minimum
    minor = a * d - q.b * q.b
    determinant = f * minor - (a * q.e * q.e - 2.0 * q.b * q.c * q.e + d * q.c * q.c)
    return a > 0.0 and minor > 0.0 and determinant > 0.0


@compiled
def solve_whole(q: Equations) -> tuple[float, float, float]:
    """X = −A⁻¹ g by the adjugate."""
    xx, xy, xt = q.d * q.f - q.e * q.e, q.c * q.e - q.b * q.f, q.b * q.e - q.c * q.d
    yy, yt, tt = q.a * q.f - q.c * q.c, q.b * q.c - q.a * q.e, q.a * q.d - q.b * q.b
    scale = -1.0 / (q.a * xx + q.b * xy + q.c * xt)
    return (
        scale * (xx * q.u + xy * q.v + xt * q.w),
        scale * (xy * q.u + yy * q.v + yt * q.w),
        scale * (xt * q.u + yt * q.v + tt * q.w),
    )


@compiled
def eigen(q: Equations) -> tuple[FloatArray, FloatArray]:
    """A diagonal matrix of A's eigenvalues, ascending, and its eigenvectors as columns.

    By Jacobi's rotations.
    """
    A, V = np.empty((3, 3)), np.zeros((3, 3))
    A[0, 0], A[0, 1], A[0, 2] = q.a, q.b, q.c
    A[1, 0], A[1, 1], A[1, 2] = q.b, q.d, q.e
    A[2, 0], A[2, 1], A[2, 2] = q.c, q.e, q.f
    V[0, 0] = V[1, 1] = V[2, 2] = 1.0
    for _ in range(SWEEPS):
        if abs(A[0, 1]) + abs(A[0, 2]) + abs(A[1, 2]) <= 1e-300:
            break
        for i in range(2):
            for j in range(i + 1, 3):
                if A[i, j] != 0.0:
                    rotate(A, V, i, j)
    for i, j in ((0, 1), (1, 2), (0, 1)):  # into ascending order
        if A[i, i] > A[j, j]:
            A[i, i], A[j, j] = A[j, j], A[i, i]
            for k in range(3):
                V[k, i], V[k, j] = V[k, j], V[k, i]
    return A, V


@compiled
def rotate(A: FloatArray, V: FloatArray, i: int, j: int) -> None:
    """Turn axes i and j so that A[i, j] becomes 0."""
    theta = 0.5 * math.atan2(2.0 * A[i, j], A[i, i] - A[j, j])
    c, s = math.cos(theta), math.sin(theta)
    for k in range(3):
        A[k, i], A[k, j] = c * A[k, i] + s * A[k, j], c * A[k, j] - s * A[k, i]
        V[k, i], V[k, j] = c * V[k, i] + s * V[k, j], c * V[k, j] - s * V[k, i]
    for k in range(3):
        A[i, k], A[j, k] = c * A[i, k] + s * A[j, k], c * A[j, k] - s * A[i, k]
    A[i, j] = A[j, i] = 0.0
