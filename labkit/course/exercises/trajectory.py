"""Chapters 5 and 10: from steps to a path, from scan to key scan, and the edges of a graph."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labkit import se2
from labkit.arrays import FloatArray
from labkit.course.exercises.exercise import exercise


# fmt: off
@exercise("What one wrong turn costs", {
    "1 rad at 100 m": (100.0, 1.0), "−2 rad at 40 m": (40.0, -2.0),
    "−0.3 rad at 10 m": (10.0, -0.3),
}, {
    "This is the length of the arc, D·|ε|: right for small turns only. The pose moves along the "
    "chord.": lambda D, e: D * abs(e),
    "This is D·sin|ε|, the part across the old direction; the pose comes nearer along it, too.":
        lambda D, e: D * math.sin(abs(e)),
    "This is D·(1 − cos ε), the part along the old direction; the pose moves across it, too.":
        lambda D, e: D * (1 - math.cos(e)),
    "This is D·tan|ε|: the pose moves along a circle, not along its tangent.":
        lambda D, e: D * math.tan(abs(e)),
    "This is D·tan|ε/2|, twice: the chord is 2·D·sin|ε/2|.":
        lambda D, e: 2 * D * math.tan(abs(e) / 2),
    "A distance is never negative: take |ε|.": lambda D, e: 2 * D * math.sin(e / 2),
    "This is the arc with its sign: take |ε|, and the chord.": lambda D, e: D * e,
    "The angle is taken for degrees; ε is in radians.":
        lambda D, e: lever_error(D, math.radians(e)),
    "The angle is turned into degrees first; ε is in radians.":
        lambda D, e: lever_error(D, math.degrees(e)),
    "This is the chord of twice the angle, 2·D·sin|ε|: halve the angle.":
        lambda D, e: 2 * D * math.sin(abs(e)),
    "This is the chord over a whole turn, 2π·D·|ε|: ε is in radians.":
        lambda D, e: 2 * math.pi * D * abs(e),
    "The root is missing: this is the square of the chord.": lambda D, e: lever_error(D, e) ** 2,
})
def lever_error(D: float, epsilon: float) -> float:
    """By the law of cosines."""
    return math.sqrt(2.0 * D**2 * (1.0 - math.cos(epsilon)))


def _seen(poses: FloatArray, way: float = -1.0, heading: Any = se2.wrap,
          shift: float = 1.0) -> FloatArray:
    away, first = poses[:, :2] - shift * poses[0, :2], poses[0, 2]
    return np.column_stack([away @ se2.rotation(way * first).T, heading(poses[:, 2] - first)])


@exercise("The path as its first pose sees it", {
    "a path that bends left": (np.array([(2.0, 1.0, 0.8), (2.5, 1.6, 1.1), (2.6, 2.4, 0.4)]),),
    "a path across ±180°": (np.array([(-1.0, 3.0, 2.6), (-1.9, 3.2, 3.0), (-2.8, 3.0, -2.9)]),),
}, {
    "The positions are shifted, and still measured along the world's axes: turn them by the first "
    "heading.": lambda p: _seen(p, way=0.0),
    "The positions are turned the wrong way: from the world into the robot's frame it is R(−ψ).":
        lambda p: _seen(p, way=1.0),
    "The positions are right; the headings are still those in the world.":
        lambda p: np.column_stack([_seen(p)[:, :2], p[:, 2]]),
    "The headings are shifted, but not wrapped to (−π, π].": lambda p: _seen(p, heading=np.array),
    "The headings lie in [0, 2π); the lab's convention is (−π, π].":
        lambda p: _seen(p, heading=lambda angle: angle % (2 * np.pi)),
    "The positions are turned, but not shifted: take the first position off.":
        lambda p: _seen(p, shift=0.0),
    "The first pose is subtracted as it is; its heading turns the axes, too.": lambda p: p - p[0],
    "The positions are still those in the world; only the headings are shifted.":
        lambda p: np.column_stack([p[:, :2], _seen(p)[:, 2]]),
    "The product is in the wrong order: the first pose's inverse stands on the left.":
        lambda p: se2.to_xytheta(se2.from_xytheta(p) @ se2.invert(se2.from_xytheta(p[0]))),
    "This is the inverse: the first pose, as the others see it.":
        lambda p: se2.to_xytheta(se2.invert(se2.from_xytheta(p)) @ se2.from_xytheta(p[0])),
    "Each pose is seen from the one before; asked for is the first.":
        lambda p: np.vstack([np.zeros(3), se2.to_xytheta(
            se2.invert(se2.from_xytheta(p[:-1])) @ se2.from_xytheta(p[1:]))]),
    "The headings have the wrong sign.": lambda p: _seen(p) * (1, 1, -1),
})
def seen_from_first(poses: FloatArray) -> FloatArray:
    """Shifted, turned back, wrapped."""
    return _seen(poses)


@exercise("The guess from the key scan", {
    f"a robot at {pose} and a step of {step}": (se2.transform(*pose), np.array(step))
    for pose, step in (((0.8, 0.3, 0.9), (0.5, 0.05, 0.2)), ((-0.2, 1.0, 2.4), (0.4, 0.0, -0.3)))
}, {
    "The step is put on the left: the robot measured it, so it acts before the pose, on its right.":
        lambda T, s: se2.transform(*s) @ T,
    "This is where the robot was; the step of the wheels is missing.": lambda T, s: T,
    "This is the step alone; the way from the key scan is missing.":
        lambda T, s: se2.transform(*s),
    "This goes from the scan before to the key scan and on: the pose is the other way round.":
        lambda T, s: se2.invert(T) @ se2.transform(*s),
    "The step goes backwards: it is inverted.":
        lambda T, s: T @ se2.invert(se2.transform(*s)),
    "The numbers are added; the step has to be turned by the robot's heading.":
        lambda T, s: se2.from_xytheta(se2.to_xytheta(T) + s),
    "The matrices are added; motions are chained by products.":
        lambda T, s: T + se2.transform(*s),
    "The turn of the step is missing.": lambda T, s: T @ se2.transform(*s[:2], 0.0),
    "The step is turned the wrong way: by R(−ψ) instead of R(ψ).":
        lambda T, s: se2.transform(*(T[:2, 2] + T[:2, :2].T @ s[:2]), se2.to_xytheta(T)[2] + s[2]),
})
def guess_from_key(T_key_before: FloatArray, step: FloatArray) -> FloatArray:
    """The coordinates of (5.2)."""
    (x, y, heading), (dx, dy, turn) = se2.to_xytheta(T_key_before), step
    c, s = math.cos(heading), math.sin(heading)
    return se2.transform(x + c * dx - s * dy, y + s * dx + c * dy, heading + turn)


def _used(T: FloatArray, reach: float, turn: float, choose: Any = max) -> Any:
    x, y, angle = se2.to_xytheta(T)
    return choose(math.sqrt(x * x + y * y) / reach, abs(angle) / turn)


@exercise("How far the key scan is used up", {
    "a robot that is ahead and aside": (se2.transform(0.9, 0.8, 0.05), 2.0, math.radians(15.0)),
    "a robot that has backed": (se2.transform(-2.6, 0.3, 0.1), 2.0, math.radians(15.0)),
    "a robot that has turned left": (se2.transform(0.5, 0.1, 0.21), 2.0, math.radians(15.0)),
    "a robot that has turned right": (se2.transform(0.6, -0.1, -0.35), 2.0, math.radians(15.0)),
}, {
    "A robot that turns to the right has a negative angle: take |Δψ|.":
        lambda T, r, a: max(_used(T, r, a, lambda way, turn: way), se2.to_xytheta(T)[2] / a),
    "Only Δx with its sign is looked at; a robot moves aside and backwards, too.":
        lambda T, r, a: max(T[0, 2] / r, _used(T, r, a, lambda way, turn: turn)),
    "Δx with its sign, and the angle with its sign: a robot backs, and turns to the right.":
        lambda T, r, a: max(T[0, 2] / r, se2.to_xytheta(T)[2] / a),
    "Only |Δx| is looked at; a robot moves aside, too: take the length.":
        lambda T, r, a: max(abs(T[0, 2]) / r, _used(T, r, a, lambda way, turn: turn)),
    "Δx and Δy are added; the way is the length of the shift.":
        lambda T, r, a: max(abs(T[:2, 2]).sum() / r, _used(T, r, a, lambda way, turn: turn)),
    "Each limit is enough alone: take the larger share, not the sum.":
        lambda T, r, a: _used(T, r, a, lambda way, turn: way + turn),
    "This is the smaller share; the larger one decides.": lambda T, r, a: _used(T, r, a, min),
    "This is the mean of the shares; the larger one decides.":
        lambda T, r, a: _used(T, r, a, lambda way, turn: (way + turn) / 2),
    "The shares are added as squares; the larger one decides.":
        lambda T, r, a: _used(T, r, a, math.hypot),
    "This is the product of the shares; the larger one decides.":
        lambda T, r, a: _used(T, r, a, lambda way, turn: way * turn),
    "The angle is in degrees and its limit in radians.":
        lambda T, r, a: _used(T, r, math.radians(a)),
    "Only the way is looked at.": lambda T, r, a: _used(T, r, a, lambda way, turn: way),
    "Only the turn is looked at.": lambda T, r, a: _used(T, r, a, lambda way, turn: turn),
    "These are metres and radians; divide each by its limit.": lambda T, r, a: _used(T, 1.0, 1.0),
})
def key_used_up(T_key_now: FloatArray, reach: float, turn: float) -> Any:
    """The larger share."""
    return _used(T_key_now, reach, turn)


def _edge(i: Any, j: Any, z: Any, way: float = -1.0, heading: float | None = None,
          wrap: Any = se2.wrap) -> FloatArray:
    x, y = se2.rotation(way * (i[2] if heading is None else heading)) @ (j[:2] - i[:2]) - z[:2]
    return np.array([x, y, wrap(j[2] - i[2] - z[2])])


@exercise("The error of an edge", {
    "an edge between neighbours": tuple(map(np.array, (
        (1.0, 2.0, 0.7), (1.5, 2.3, 1.0), (0.6, 0.0, 0.45)))),
    "an edge across ±180°": tuple(map(np.array, (
        (0.0, 1.0, 3.0), (-0.6, 1.1, -3.1), (0.6, -0.1, 0.1)))),
    "an edge that is wrong by half a turn": tuple(map(np.array, (
        (0.5, 1.0, -3.0), (-0.6, 1.4, 0.1), (0.9, 0.1, -0.2)))),
}, {
    "The displacement is still measured along the world's axes: turn it by R(ψ_i)ᵀ.":
        lambda i, j, z: _edge(i, j, z, way=0.0),
    "The displacement is turned the wrong way: into the frame of pose i it is R(ψ_i)ᵀ.":
        lambda i, j, z: _edge(i, j, z, way=1.0),
    "The displacement is turned by the heading of pose j; the edge is measured from pose i.":
        lambda i, j, z: _edge(i, j, z, heading=j[2]),
    "The angle may be a whole turn off: wrap it.":
        lambda i, j, z: _edge(i, j, z, wrap=lambda angle: angle),
    "The angle is wrapped to [0, 2π); the lab's convention is (−π, π].":
        lambda i, j, z: _edge(i, j, z, wrap=lambda angle: angle % (2 * np.pi)),
    "Only the difference of the headings is wrapped; wrap the error itself.":
        lambda i, j, z: np.append(_edge(i, j, z)[:2], se2.wrap(j[2] - i[2]) - z[2]),
    "This is what the edge should measure; subtract what it measured.":
        lambda i, j, z: _edge(i, j, 0 * z),
    "The sign is turned round: it is prediction minus measurement.":
        lambda i, j, z: -_edge(i, j, z),
    "The poses are exchanged: the edge goes from pose i to pose j.":
        lambda i, j, z: _edge(j, i, z),
    "The measurement is turned with the displacement; it is in the frame of pose i already.":
        lambda i, j, z: np.append(
            se2.rotation(-i[2]) @ (j[:2] - i[:2] - z[:2]), _edge(i, j, z)[2]),
    "The error is measured along the world's axes; turn it into the frame of pose i.":
        lambda i, j, z: np.append(
            j[:2] - i[:2] - se2.rotation(i[2]) @ z[:2], _edge(i, j, z)[2]),
    "The error is turned into the frame of the measured end; leave it in that of pose i.":
        lambda i, j, z: np.append(se2.rotation(-z[2]) @ _edge(i, j, z)[:2], _edge(i, j, z)[2]),
})
def edge_error(pose_i: FloatArray, pose_j: FloatArray, measured: FloatArray) -> FloatArray:
    """In the frame of pose i."""
    return _edge(pose_i, pose_j, measured)
