"""Pairs: what became of each of them, and how that looks in a picture."""

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

FATES = {  # colour, marker with line, and the marker's size
    "gated": (GATED, "x:", 4.5),  # farther apart than d_max
    "trimmed": (TRIMMED, "s--", 4.0),  # not among the ⌊ρN⌋ closest
    "no line": (NO_LINE, "D-.", 3.5),  # point-to-line only: the target has no normal there
    "down-weighted": (DOWN_WEIGHTED, "^-.", 4.5),  # kept, residual beyond Huber's δ
    "kept": (KEPT, "o-", 2.6),  # with full weight
}


def fates(pairs: Correspondences) -> NDArray[np.str_]:
    """Fate of each of N pairs, shape (N,); the first stage that rejects it counts."""
    judged = [~pairs.within_gate, ~pairs.within_overlap, ~pairs.kept, pairs.weights < 1.0]
    *rejected, kept = FATES
    return np.select(judged, rejected, default=kept)


def plot_correspondences(ax: Axes, target: Scan | ArrayLike, pairs: Correspondences) -> Axes:
    """Draw each pair as a line from the moved source point, which is marked, to its target point.

    Line and marker tell the pair's fate: gated, trimmed, down-weighted or kept; the legend counts
    each of them. "no line", where the target has no normal, appears only where it happened.

    Parameters
    ----------
    target : Scan or array_like, shape (M, 2)
        The older scan [m].
    pairs : Correspondences
        The association, with the source where it was matched.
    """
    draw_target(ax, scan_points(target, "target"))
    gaps = np.full_like(pairs.source, np.nan)  # between one line and the next
    lines = np.stack([pairs.source, pairs.target, gaps], axis=1)
    for fate, (color, look, size) in FATES.items():
        chosen = fates(pairs) == fate
        if fate == "no line" and not chosen.any():
            continue
        filled = fate in {"down-weighted", "kept"}
        face, edge, layer = (color, 0.0, 2.6) if filled else ("none", 0.9, 2.4)
        xy, label = lines[chosen].reshape(-1, 2).T, f"{fate}: {np.count_nonzero(chosen)}"
        (line,) = ax.plot(*xy, look, color=color, lw=1.0, markevery=3, ms=size, label=label)
        line.set(markerfacecolor=face, markeredgewidth=edge, zorder=layer)
    style_plane(ax)
    ax.set_title(f"{pairs.inlier_count} of {len(pairs.kept)} pairs are inliers")
    legend_below(ax)
    return ax
