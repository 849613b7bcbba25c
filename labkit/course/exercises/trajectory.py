"""Chapters 5 and 10: from steps to a path, from scan to key scan, and the edges of a graph."""

import math

import numpy as np

from labkit import se2
from labkit.course.exercises import exercise


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
    "A distance is never negative: take |ε|.": lambda D, e: 2 * D * math.sin(e / 2),
})
def lever_error(D, epsilon):
    """By the law of cosines."""
    return math.sqrt(2.0 * D**2 * (1.0 - math.cos(epsilon)))


@exercise("The path as its first pose sees it", {
    "a path that bends left": (np.array([(2.0, 1.0, 0.8), (2.5, 1.6, 1.1), (2.6, 2.4, 0.4)]),),
    "a path across ±180°": (np.array([(-1.0, 3.0, 2.6), (-1.9, 3.2, 3.0), (-2.8, 3.0, -2.9)]),),
}, {
    "The positions are shifted, and still measured along the world's axes: turn them by the first "
    "heading.": {" @ se2.rotation(-poses[0, 2]).T": ""},
    "The positions are turned the wrong way: into the robot's frame it is R(−ψ).":
        {"rotation(-": "rotation("},
    "The headings lie in [0, 2π), not in (−π, π].": {"se2.wrap(turns)": "turns % (2 * np.pi)"},
    "The headings leave (−π, π]: wrap them.": {"se2.wrap(turns)": "turns"},
    "Each position is turned by its own heading; all are seen from the first pose.":
        lambda p: np.column_stack([
            np.einsum("kij,kj->ki", se2.rotation(-p[:, 2]), p[:, :2] - p[0, :2]),
            se2.wrap(p[:, 2] - p[0, 2])]),
    "The first pose is subtracted as it is; its heading turns the axes, too.": lambda p: p - p[0],
})
def seen_from_first(poses):
    """Shifted, turned back, wrapped."""
    shifts = poses[:, :2] - poses[0, :2]
    turns = poses[:, 2] - poses[0, 2]
    return np.column_stack([shifts @ se2.rotation(-poses[0, 2]).T, se2.wrap(turns)])


@exercise("The guess from the key scan", {
    f"a robot at {pose} and a step of {step}": (se2.transform(*pose), np.array(step))
    for pose, step in (((0.8, 0.3, 0.9), (0.5, 0.05, 0.2)), ((-0.2, 1.0, 2.4), (0.4, 0.0, -0.3)))
}, {
    "The step is put on the left: the robot measured it, so it acts before the pose, on its right.":
        lambda T, s: se2.transform(*s) @ T,
    "The numbers are added; the step has to be turned by the robot's heading.":
        lambda T, s: se2.from_xytheta(se2.to_xytheta(T) + s),
    "The step is turned the wrong way: by R(−ψ) instead of R(ψ).": {"math.sin": "-math.sin"},
    "The step is turned by the new heading; it is measured in the frame before it.":
        {"math.cos(heading), math.sin(heading)":
         "math.cos(heading + turn), math.sin(heading + turn)"},
    "The step is turned by the mean of both headings; it is measured in the frame before it.":
        {"math.cos(heading), math.sin(heading)":
         "math.cos(heading + turn / 2), math.sin(heading + turn / 2)"},
})
def guess_from_key(T_key_before, step):
    """The coordinates of (5.2)."""
    x, y, heading = se2.to_xytheta(T_key_before)
    dx, dy, turn = step
    c, s = math.cos(heading), math.sin(heading)
    return se2.transform(x + c * dx - s * dy, y + s * dx + c * dy, heading + turn)


@exercise("How far the key scan is used up", {
    "a robot that is ahead and aside": (se2.transform(0.9, 0.8, 0.05), 2.0, math.radians(15.0)),
    "a robot that has backed": (se2.transform(-2.6, 0.3, 0.1), 2.0, math.radians(15.0)),
    "a robot that has turned left": (se2.transform(0.5, 0.1, 0.21), 2.0, math.radians(15.0)),
    "a robot that has turned right": (se2.transform(0.6, -0.1, -0.35), 2.0, math.radians(15.0)),
}, {
    "Only |Δx| is looked at; a robot moves aside, too.": {"math.hypot(x, y)": "abs(x)"},
    "Δx and Δy are added; the way is their length.": {"math.hypot(x, y)": "(abs(x) + abs(y))"},
    "Take the larger share, not the sum.":
        {"max(shift_share, turn_share)": "shift_share + turn_share"},
    "This is the smaller share; the key scan is used up as soon as one of them is 1.":
        {"max(shift_share, turn_share)": "min(shift_share, turn_share)"},
    "The angle keeps its sign, so that turns to the right never count: take its size.":
        {"abs(psi)": "psi"},
})
def key_used_up(T_key_now, reach, turn):
    """The larger share."""
    x, y, psi = se2.to_xytheta(T_key_now)
    shift_share = math.hypot(x, y) / reach
    turn_share = abs(psi) / turn
    return max(shift_share, turn_share)


@exercise("The error of an edge", {
    "an edge between neighbours": tuple(map(np.array, (
        (1.0, 2.0, 0.7), (1.5, 2.3, 1.0), (0.6, 0.0, 0.45)))),
    "an edge across ±180°": tuple(map(np.array, (
        (0.0, 1.0, 3.0), (-0.6, 1.1, -3.1), (0.6, -0.1, 0.1)))),
    "an edge that is wrong by half a turn": tuple(map(np.array, (
        (0.5, 1.0, -3.0), (-0.6, 1.4, 0.1), (0.9, 0.1, -0.2)))),
}, {
    "The displacement is still measured along the world's axes: turn it by R(ψ_i)ᵀ.":
        {"se2.rotation(-pose_i[2]) @ (x, y)": "(x, y)"},
    "The displacement is turned the wrong way: into the frame of pose i it is R(ψ_i)ᵀ.":
        {"-pose_i[2]": "pose_i[2]"},
    "The displacement is turned by the heading of pose j; the edge is measured from pose i.":
        {"-pose_i[2]": "-pose_j[2]"},
    "Only the difference of the headings is wrapped; wrap the error itself.":
        {"turn - measured[2])": "turn) - measured[2]"},
})
def edge_error(pose_i, pose_j, measured):
    """In the frame of pose i."""
    x, y, turn = pose_j - pose_i
    shift = se2.rotation(-pose_i[2]) @ (x, y) - measured[:2]
    return np.append(shift, se2.wrap(turn - measured[2]))
