"""Pairs of points, each drawn in the look of its fate."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from labkit.correspondences import Correspondences
from labkit.plotting.scans import draw_target, scan_points
from labkit.plotting.style import (
    DOWN_WEIGHTED,
    GATED,
    KEPT,
    NO_LINE,
    TRIMMED,
    legend_below,
    style_plane,
)
from labkit.scan import Scan
from labkit.support.arrays import check_kind

FATES = {  # colour, marker with line, size of the marker
    "gated": (GATED, "x:", 4.5),  # farther apart than d_max
    "trimmed": (TRIMMED, "s--", 4.0),  # not among the ⌊ρN⌋ closest
    "no line": (NO_LINE, "D-.", 3.5),  # point-to-line only: the target has no normal there
    "down-weighted": (DOWN_WEIGHTED, "^-.", 4.5),  # kept, residual beyond Huber's δ
    "kept": (KEPT, "o-", 2.6),  # with full weight
}


def fates(pairs: Correspondences) -> NDArray[np.str_]:
    """Fate of each of N pairs, shape (N,); the first stage that rejects it counts."""
    rejected_by = [~pairs.within_gate, ~pairs.within_overlap, ~pairs.kept, pairs.weights < 1.0]
    *names, kept = FATES
    return np.select(rejected_by, names, default=kept)


def plot_correspondences(ax: Axes, target: Scan | ArrayLike, pairs: Correspondences) -> Axes:
    """Draw each pair as a line from the moved source point, which is marked, to its target point.

    Line and marker show the fate of the pair: gated, trimmed, down-weighted or kept; the legend
    counts each of them. "no line", where the target has no normal, appears only if it occurs.

    Parameters
    ----------
    target : Scan or array_like, shape (M, 2)
        The older scan [m].
    pairs : Correspondences
        The pairs, with the source points as moved when they were matched.
    """
    check_kind(ax, "ax", Axes)
    check_kind(pairs, "pairs", Correspondences)
    draw_target(ax, scan_points(target, "target"))
    gaps = np.full_like(pairs.source, np.nan)  # between one line and the next
    lines = np.stack([pairs.source, pairs.target, gaps], axis=1)
    fate_of_pair = fates(pairs)
    for fate, (color, line_style, size) in FATES.items():
        chosen = fate_of_pair == fate
        count = np.count_nonzero(chosen)
        if fate == "no line" and count == 0:
            continue
        (line,) = ax.plot(
            *lines[chosen].reshape(-1, 2).T,
            line_style,
            color=color,
            lw=1.0,
            markevery=3,
            ms=size,
            label=f"{fate}: {count}",
        )
        if fate in {"down-weighted", "kept"}:
            line.set(markerfacecolor=color, markeredgewidth=0.0, zorder=2.6)
        else:
            line.set(markerfacecolor="none", markeredgewidth=0.9, zorder=2.4)
    style_plane(ax)
    ax.set_title(f"{pairs.inlier_count} of {len(pairs.kept)} pairs are inliers")
    legend_below(ax)
    return ax
