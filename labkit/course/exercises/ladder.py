"""Chapter 5: the student's loop becomes an odometry, by a gate, Huber's weight and lines."""

import numpy as np

from labkit import Target, align, apply, invert, transform
from labkit.correspondences import huber_weights
from labkit.course.exercises import exercise
from labkit.course.exercises.se2 import look
from labkit.line_alignment import align_to_lines

LEFT = "The step is put on the right of `T`; it acts after `T`, so it belongs on the left."


def _with_moved_points(**options):
    """Two pairs of scans; of each option one value for the first pair and one for the second."""
    cases = {}
    for turn, *values in zip((0.4, -1.3), *options.values(), strict=True):
        T, older = transform(0.4, 0.2, turn), look(np.eye(3))
        newer = look(T, 181).copy()
        newer[::5] += (0.5, 0.4)  # what has moved between the scans
        guess = T @ transform(-0.1, 0.05, 0.04)
        cases[f"a robot that turned by {turn:g} rad"] = (newer, older, guess, *values)
    return cases


def _beyond_the_end():
    """Two walls, and points beyond the end of one: far from it, but nearly on its line."""
    along = np.arange(0.0, 3.0, 0.05)
    still = np.zeros_like(along)
    wall = np.column_stack([along, still])
    side_wall = np.column_stack([still + 4.0, along + 1.0])
    older = np.vstack([wall, side_wall])
    beyond = np.linspace((-1.5, 0.3), (-0.5, 0.1), 21)
    T = transform(0.1, 0.05, 0.03)
    newer = apply(invert(T), np.vstack([older, beyond]))
    guess = T @ transform(-0.05, 0.03, 0.02)
    return newer, older, guess, 0.4, 0.02, 6


# fmt: off
@exercise("A gate for your loop", lambda: _with_moved_points(gate=(0.4, 0.25), rounds=(6, 4)), {
    LEFT: {"align(p[near], q[near]) @ T": "T @ align(p[near], q[near])"},
    "This is the last step alone; the answer is the product of all.": {"q[near]) @ T": "q[near])"},
    "The source is not moved before its neighbours are searched: apply `T` first.":
        {"apply(T, source)": "source"},
})
def gated_icp(source, target, T_init, gate=0.3, rounds=15):
    """The loop of chapter 4 over the pairs within the gate."""
    T, older = T_init, Target(target)
    for _ in range(rounds):
        p = apply(T, source)
        index, d = older.search.query(p)
        q, near = older.points[index], d <= gate
        T = align(p[near], q[near]) @ T
    return T


@exercise("Huber's weight for your loop", lambda: _with_moved_points(
    gate=(0.4, 0.25), delta=(0.08, 0.03), rounds=(6, 4)), {
    "The weight is δ/r beyond δ only; up to δ it is 1.":
        {"huber_weights(d[near], delta)": "delta / np.maximum(d[near], 1e-12)"},
    "The weight falls with the square of the distance; it is δ/r.":
        {"huber_weights(d[near], delta)": "huber_weights(d[near], delta) ** 2"},
    "The pairs beyond δ are dropped; Huber's weight keeps them.":
        {"huber_weights(d[near], delta)": "(d[near] <= delta).astype(float)"},
    LEFT: {"align(p[near], q[near], w) @ T": "T @ align(p[near], q[near], w)"},
})
def robust_icp(source, target, T_init, gate=0.3, delta=0.05, rounds=15):
    """The gated loop, in which a pair beyond δ weighs less."""
    T, older = T_init, Target(target)
    for _ in range(rounds):
        p = apply(T, source)
        index, d = older.search.query(p)
        q, near = older.points[index], d <= gate
        w = huber_weights(d[near], delta)
        T = align(p[near], q[near], w) @ T
    return T


@exercise("A step to lines", lambda: {
    **_with_moved_points(gate=(0.4, 0.25), delta=(0.03, 0.01), rounds=(6, 4)),
    "points beyond the end of a wall": _beyond_the_end(),
}, {
    "The weights are those of the distances d; the residual of a line is e, across the wall.":
        {"abs(e[on])": "d[on]"},
    "This still aligns points with points.": {"align_to_lines(p[on], q[on], n[on], w)":
                                             "align(p[on], q[on], w)"},
    LEFT: {"T = align_to_lines(p[on], q[on], n[on], w) @ T":
           "T = T @ align_to_lines(p[on], q[on], n[on], w)"},
})
def line_icp(source, target, T_init, gate=0.3, delta=0.02, rounds=15):
    """The robust loop on the distances from the walls."""
    T, older = T_init, Target(target)
    for _ in range(rounds):
        p = apply(T, source)
        index, d = older.search.query(p)
        q, n = older.points[index], older.normals[index]
        e = ((p - q) * n).sum(axis=1)
        on = (d <= gate) & np.isfinite(n[:, 0])
        w = huber_weights(abs(e[on]), delta)
        T = align_to_lines(p[on], q[on], n[on], w) @ T
    return T
