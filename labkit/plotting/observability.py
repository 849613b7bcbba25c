"""Free directions, along which a scan may slide unnoticed, drawn on its points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from labkit.line_alignment import Information
from labkit.plotting.scans import draw_target, scan_points
from labkit.plotting.style import GREY, METHODS, PURPLE, legend_below, style_plane
from labkit.scan import Scan
from labkit.support.arrays import FloatArray, check_kind

ARROW_COUNT = 24  # for each direction, about
DIRECTION_COLORS = (*METHODS, PURPLE)  # of the first, second and third free direction
ARROW_LENGTH = 0.1  # of the longest arrow, relative to the longer side of the scan
IN_METRES: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "units": "inches"}
MIN_HALF_SIDE = 0.15  # of the picture, relative to the longer side of the scan


def plot_observability(ax: Axes, target: Scan | ArrayLike, information: Information) -> Axes:
    """Draw how the points would move along the free directions.

    The arrows show motions (Δx, Δy, ℓ Δψ) that leave the points on their surfaces, to scale among
    themselves. If no direction is free, thin grey arrows show the one that the scan fixes least.

    Parameters
    ----------
    target : Scan or array_like, shape (N, 2)
        The scan [m], in the frame of `information`.
    information : Information
        Of `labkit.degeneracy.observability` or `labkit.line_alignment.line_information`.
    """
    check_kind(ax, "ax", Axes)
    check_kind(information, "information", Information)
    points = scan_points(target, "target")
    handles: list[Artist] = [draw_target(ax, points)]
    extent = max(float(np.ptp(points, axis=0).max()), 1e-9)
    if information.degenerate:
        for direction, color in zip(information.free.T, DIRECTION_COLORS, strict=False):
            _draw_arrows(ax, points, information, direction, extent, color=color, width=0.022)
            handles.append(_legend_entry("free", direction, color))
    else:
        least_fixed = information.vectors[:, 0]
        _draw_arrows(ax, points, information, least_fixed, extent, color=GREY, width=0.012)
        handles.append(_legend_entry("fixed, known least", least_fixed, GREY))
    middle = points.mean(axis=0)
    half_side = MIN_HALF_SIDE * extent  # a single wall, too, gets a picture with some width
    ax.update_datalim([middle - half_side, middle + half_side])
    ax.autoscale_view()
    style_plane(ax)
    legend_below(ax, handles)
    return ax


def motion_field(information: Information, direction: FloatArray, points: FloatArray) -> FloatArray:
    """Motion of points (N, 2), to first order, along (Δx, Δy, ℓ Δψ), shape (N, 2) [m]."""
    arm = points - information.center
    arm_left = np.column_stack([-arm[:, 1], arm[:, 0]])
    return np.asarray(direction[:2] + direction[2] / information.length * arm_left)


def _draw_arrows(
    ax: Axes,
    points: FloatArray,
    information: Information,
    direction: FloatArray,
    extent: float,
    **style: Any,
) -> None:
    """Draw the motion along a direction at some of the points, which extend over `extent` [m]."""
    tails = points[:: max(1, len(points) // ARROW_COUNT)]
    arrows = motion_field(information, direction, tails)
    arrows *= ARROW_LENGTH * extent / np.hypot(*arrows.T).max()
    ax.quiver(*tails.T, *arrows.T, headwidth=4.5, zorder=2.5, **style, **IN_METRES)
    ax.update_datalim(tails + arrows)


def _legend_entry(state: str, direction: FloatArray, color: str) -> Line2D:
    is_mostly_turn = abs(direction[2]) > np.sqrt(0.5)
    label = f"{state}: {'a turn' if is_mostly_turn else 'a shift'}"
    return Line2D([], [], color=color, marker=">", linewidth=2.0, label=label)
