"""Free directions, in which a scan may slide unnoticed, drawn on its points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from labkit.line_alignment import Information
from labkit.plotting.scans import draw_target, scan_points
from labkit.plotting.style import GREY, METHODS, PURPLE, legend_below, style_plane
from labkit.scan import Scan
from labkit.support.arrays import FloatArray

ARROWS = 24  # about so many are drawn along the scan
COLORS = (*METHODS, PURPLE)  # of the first, second and third free direction
ARROW_SHARE = 0.1  # of the scan's longer side: the longest arrow
TO_SCALE: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "units": "inches"}
NARROWEST = 0.15  # of the longer side is shown to either side of the middle


def plot_observability(ax: Axes, target: Scan | ArrayLike, information: Information) -> Axes:
    """Draw how the points would move along the free directions.

    The arrows show motions (Δx, Δy, ℓ Δψ) that the surface does not answer, to scale among
    themselves. Where all is fixed, thin grey ones show the direction that the scan knows least.

    Parameters
    ----------
    target : Scan or array_like, shape (N, 2)
        The scan [m], in the frame of `information`.
    information : Information
        Of `labkit.degeneracy.observability` or `labkit.line_alignment.line_information`.
    """
    points = scan_points(target, "target")
    handles = [draw_target(ax, points)]
    count = information.free.shape[1]
    directions = information.free if count else information.vectors[:, :1]
    at = points[:: max(1, len(points) // ARROWS)]
    extent = max(float(np.ptp(points, axis=0).max()), 1e-9)
    size = ARROW_SHARE * extent
    for direction, color in zip(directions.T, COLORS if count else [GREY], strict=False):
        arrows = motion_field(information, direction, at)
        arrows *= size / np.hypot(*arrows.T).max()
        width = 0.022 if count else 0.012
        ax.quiver(*at.T, *arrows.T, color=color, width=width, headwidth=4.5, zorder=2.5, **TO_SCALE)
        ax.update_datalim(at + arrows)
        kind = "a turn" if abs(direction[2]) > np.sqrt(0.5) else "a shift"  # mostly
        label = f"{'free' if count else 'fixed, known least'}: {kind}"
        handles.append(Line2D([], [], color=color, marker=">", linewidth=2.0, label=label))
    middle = points.mean(axis=0)  # a single wall, too, gets a picture with some width
    ax.update_datalim([middle - NARROWEST * extent, middle + NARROWEST * extent])
    ax.autoscale_view()
    style_plane(ax)
    legend_below(ax, handles)
    return ax


def motion_field(information: Information, direction: FloatArray, points: FloatArray) -> FloatArray:
    """Motion of points (N, 2), to first order, along (Δx, Δy, ℓ Δψ), shape (N, 2) [m]."""
    arm = points - information.center
    turned = np.column_stack([-arm[:, 1], arm[:, 0]])
    return np.asarray(direction[:2] + direction[2] / information.length * turned)
