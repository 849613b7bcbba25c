"""Pairs: what became of each of them, and how that looks in a picture."""

from __future__ import annotations

from enum import IntEnum

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


class Fate(IntEnum):
    """The end of a pair on its way through the stages; the first that rejects it counts."""

    GATED = 0  # farther apart than d_max
    TRIMMED = 1  # not among the ⌊ρN⌋ closest
    NO_LINE = 2  # point-to-line only: the target has no normal there
    DOWN_WEIGHTED = 3  # kept, residual beyond Huber's δ
    KEPT = 4  # kept with full weight

    @property
    def label(self) -> str:
        """The word for a legend."""
        return self.name.lower().replace("down_", "down-").replace("_", " ")


def fates(pairs: Correspondences) -> NDArray[np.int8]:
    """The fate of each of N pairs, values of `Fate`, shape (N,); each has exactly one.

    Examples
    --------
    >>> import labkit
    >>> target = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0]]
    >>> moved = [[0.1, 0.0], [4.1, 0.0], [0.1, 3.0], [4.9, 3.0]]
    >>> result = labkit.icp(moved, target)
    >>> [Fate(fate).label for fate in fates(result.correspondences)]
    ['kept', 'kept', 'kept', 'gated']
    """
    judged = [~pairs.within_gate, ~pairs.within_overlap, ~pairs.kept, pairs.weights < 1.0]
    return np.select(judged, list(map(np.int8, Fate))[:4], default=np.int8(Fate.KEPT))


STYLES: dict[Fate, tuple[str, str, str, float]] = {  # colour, line, marker and its size
    Fate.GATED: (GATED, ":", "x", 4.5),
    Fate.TRIMMED: (TRIMMED, "--", "s", 4.0),
    Fate.NO_LINE: (NO_LINE, "-.", "D", 3.5),
    Fate.DOWN_WEIGHTED: (DOWN_WEIGHTED, "-.", "^", 4.5),
    Fate.KEPT: (KEPT, "-", "o", 2.6),
}


def plot_correspondences(ax: Axes, target: Scan | ArrayLike, pairs: Correspondences) -> Axes:
    """Draw each pair as a line from the moved source point, which is marked, to its target point.

    Line and marker tell the pair's fate, see `labkit.plotting.fates`; the legend counts
    each of them. "no line" appears only where it happened.

    Parameters
    ----------
    target : Scan or array_like, shape (M, 2)
        The older scan [m].
    pairs : Correspondences
        The association, with the source where it was matched.
    """
    draw_target(ax, scan_points(target, "target"))
    fate_of = fates(pairs)
    gaps = np.full_like(pairs.source, np.nan)  # between one line and the next
    lines = np.stack([pairs.source, pairs.target, gaps], axis=1)
    for fate, (color, dash, marker, size) in STYLES.items():
        chosen = fate_of == fate
        if fate is Fate.NO_LINE and not chosen.any():
            continue
        ax.plot(
            *lines[chosen].reshape(-1, 2).T,
            color=color,
            linestyle=dash,
            linewidth=1.0,
            marker=marker,
            markevery=3,
            markersize=size,
            markerfacecolor=color if fate >= Fate.DOWN_WEIGHTED else "none",
            markeredgewidth=0.0 if fate >= Fate.DOWN_WEIGHTED else 0.9,
            zorder=2.2 + 0.1 * fate,
            label=f"{fate.label}: {np.count_nonzero(chosen)}",
        )
    style_plane(ax)
    ax.set_title(f"{pairs.inlier_count} of {len(pairs.kept)} pairs are inliers")
    legend_below(ax)
    return ax
