"""Two scans in one picture, and helpers of every picture of scans."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from labkit.plotting.style import SOURCE, TARGET, legend_below, style_plane
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.se2 import apply
from labkit.support.arrays import FloatArray, PointSet, as_points, as_transform, check_kind


def plot_scans(
    ax: Axes,
    source: IcpResult | Scan | ArrayLike,
    target: PointSet | ArrayLike | None = None,
    T_target_source: ArrayLike | None = None,
) -> Axes:
    """Draw the target, and the source moved into its frame.

    Parameters
    ----------
    source : IcpResult, Scan or array_like, shape (N, 2)
        The newer scan [m]: open circles. A result alone stands for its scans and its estimate.
    target : Scan or array_like, shape (M, 2)
        The older scan [m]: black dots.
    T_target_source : array_like, shape (3, 3), optional
        Motion of the source: the guess, or the estimate. By default the source stays in its
        own coordinates, as before any registration.

    Examples
    --------
    >>> from labkit.plotting import book_figure
    >>> ax = plot_scans(book_figure().subplots(), [[0.0, 1.0]], [[0.0, 0.9]])
    """
    if isinstance(source, IcpResult):
        return plot_scans(ax, source.source, source.target, source.T_target_source)
    check_kind(ax, "ax", Axes)
    p = scan_points(source, "source")
    q = scan_points(target, "target")
    title, name = "Scans as measured", "source"
    if T_target_source is not None:
        p = apply(as_transform(T_target_source, "T_target_source"), p)
        title, name = "Source moved onto the target", "source, moved"
    draw_target(ax, q)
    label = f"{name} ({len(p)} points)"
    ax.plot(*p.T, "o", ms=3.8, mew=0.8, mfc="none", color=SOURCE, label=label)
    ax.set_title(title)
    style_plane(ax)
    legend_below(ax)
    return ax


def draw_target(ax: Axes, points: FloatArray) -> Line2D:
    """Draw the older scan, points (M, 2) [m], as black dots."""
    label = f"target ({len(points)} points)"
    (line,) = ax.plot(*points.T, ".", ms=3.5, mew=0.0, color=TARGET, label=label)
    return line


def scan_points(scan: PointSet | ArrayLike | None, name: str) -> FloatArray:
    """Points of a scan, or a checked array of them, shape (N, 2) [m]; not empty."""
    return as_points(scan, name)
