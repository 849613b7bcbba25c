"""Text for a terminal: poses in metres and degrees, errors in a table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from labkit.evaluation import PoseErrors
from labkit.se2 import to_xytheta
from labkit.support.arrays import FloatArray


def pose_text(T: FloatArray) -> str:
    """Format a transform on one line."""
    x, y, theta = to_xytheta(T)
    return f"t = ({x:.4f}, {y:.4f}) m, theta = {math.degrees(theta):.3f} deg"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Align columns under a header: the first to the left, the others to the right."""
    lines = [list(header), *map(list, rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(header))]
    return "\n".join(
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])]).rstrip()
        for line in lines
    )


ERROR_HEADER = ("error", "median", "p95", "max", "rmse", "", "median", "p95", "max", "rmse")


def error_row(name: str, errors: PoseErrors) -> list[str]:
    """Translation errors in metres and rotation errors in degrees, for `ERROR_HEADER`."""
    t, r = errors.translation, errors.rotation
    return [
        name,
        *(f"{value:.3f} m" for value in (t.median, t.p95, t.max, t.rmse)),
        "|",
        *(f"{math.degrees(value):.3f}°" for value in (r.median, r.p95, r.max, r.rmse)),
    ]
