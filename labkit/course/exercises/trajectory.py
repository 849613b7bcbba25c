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
    square = 2.0 * D**2 * (1.0 - math.cos(epsilon))
    return math.sqrt(square)


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
    positions = shifts @ se2.rotation(-poses[0, 2]).T
    return np.column_stack([positions, se2.wrap(turns)])


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
    shift = se2.rotation(-pose_i[2]) @ (x, y)
    return np.append(shift - measured[:2], se2.wrap(turn - measured[2]))
