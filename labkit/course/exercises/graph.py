"""Chapter 10: the error of an edge in a pose graph."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labkit.course.exercises.exercise import Case, exercise


@exercise("The error of an edge")
def edge_error() -> Iterator[Case]:
    """For an edge with an error in each coordinate, and one across ±180°."""
    edges = {
        "an edge between neighbours": ((1.0, 2.0, 0.7), (1.5, 2.3, 1.0), (0.6, 0.0, 0.25)),
        "an edge across ±180°": ((0.0, 1.0, 3.0), (-0.6, 1.1, -3.1), (0.6, -0.1, 0.1)),
    }
    for where, (pose_i, pose_j, measured) in edges.items():
        dx, dy, turn = np.subtract(pose_j, pose_i).tolist()
        c, s = math.cos(pose_i[2]), math.sin(pose_i[2])
        angle = math.remainder(turn - measured[2], math.tau)

        def error(x: float, y: float, last: float, z: tuple[float, ...] = measured) -> np.ndarray:
            return np.array([x - z[0], y - z[1], last])

        mistakes = {
            "The displacement is still measured along the world's axes: turn it by R(ψ_i)ᵀ.": (
                error(dx, dy, angle)
            ),
            "The displacement is turned the wrong way: into the frame of pose i it is R(ψ_i)ᵀ.": (
                error(c * dx - s * dy, s * dx + c * dy, angle)
            ),
        }
        if abs(turn - measured[2]) > math.pi:
            mistakes["The angle is a whole turn off: wrap it."] = error(
                c * dx + s * dy, c * dy - s * dx, turn - measured[2]
            )
        yield Case(
            where,
            (np.array(pose_i), np.array(pose_j), np.array(measured)),
            error(c * dx + s * dy, c * dy - s * dx, angle),
            mistakes,
        )
