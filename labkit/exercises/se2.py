"""Chapter 1: motions of the plane, and the order in which they chain."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labkit import se2
from labkit.arrays import FloatArray
from labkit.exercises.exercise import Case, exercise


@exercise("Motion between two poses")
def motion_between() -> Iterator[Case]:
    """For two poses whose headings differ from each other and from the world's."""
    places = {
        "a robot that bends left": ((2.0, 1.0, 0.5), (2.4, 1.3, 0.9)),
        "a robot that faces left and bends right": ((1.0, 0.0, 1.6), (1.1, 1.0, 1.4)),
    }
    for where, (older, newer) in places.items():
        T_w_k, T_w_k1 = se2.transform(*older), se2.transform(*newer)
        turn, step = newer[2] - older[2], T_w_k1[:2, 2] - T_w_k[:2, 2]
        yield Case(
            where,
            (T_w_k, T_w_k1),
            _motion(se2.rotation(-older[2]) @ step, turn),
            {
                "This is the same motion seen from the world, `T_w_k1 @ T_k_w`: in the names, "
                "equal letters must meet in the middle.": T_w_k1 @ se2.invert(T_w_k),
                "This is the way back, from the newer pose to the older one: it is the inverse "
                "of what is asked.": se2.relative(T_w_k1, T_w_k),
                "The translation is the difference of the positions in the *world*; the robot's "
                "frame at time k is turned against it.": _motion(step, turn),
            },
        )


@exercise("Turn about a point")
def turn_about() -> Iterator[Case]:
    """For a turn to the left and one to the right."""
    for c, theta in ((np.array([2.0, -1.0]), 0.7), (np.array([0.5, 3.0]), -2.0)):
        away = c - se2.rotation(theta) @ c
        yield Case(
            f"a turn by {theta:g} rad about ({c[0]:g}, {c[1]:g})",
            (c, theta),
            _motion(away, theta),
            {
                "This turns about the origin; bring `c` there first.": _motion(0 * c, theta),
                "This turns about −c: it moves the plane by `c` first, where it should bring `c` "
                "to the origin.": _motion(-away, theta),
                "This turns about the origin and then moves the plane by `c`; bring `c` to the "
                "origin first, and back afterwards.": _motion(c, theta),
            },
        )


def _motion(t: FloatArray, theta: float) -> FloatArray:
    return se2.transform(t[0], t[1], theta)
