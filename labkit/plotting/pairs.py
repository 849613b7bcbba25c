"""Pairs: what became of each of them, and how that looks in a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from labkit.correspondences import Correspondences
from labkit.plotting.scans import draw_target, scan_points
from labkit.plotting.style import BLUE, GREEN, GREY, ORANGE, VERMILLION, legend_below, style_plane
from labkit.scan import Scan


class Fate(IntEnum):
    """The end of a pair on its way through gate, trimming and weighting.

    A pair that several stages reject is counted at the first of them, in the order of
    the lesson's flow chart.
    """

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
    """The fate of each pair.

    Parameters
    ----------
    pairs : Correspondences
        One association of N source points.

    Returns
    -------
    ndarray of int8, shape (N,)
        Values of `Fate`. Every pair has exactly one.

    Examples
    --------
    >>> import labkit
    >>> target = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0]]
    >>> moved = [[0.1, 0.0], [4.1, 0.0], [0.1, 3.0], [4.9, 3.0]]
    >>> result = labkit.icp(moved, target)
    >>> [Fate(fate).label for fate in fates(result.correspondences)]
    ['kept', 'kept', 'kept', 'gated']
    """
    return np.select(
        [~pairs.within_gate, ~pairs.within_overlap, ~pairs.kept, pairs.weights < 1.0],
        [
            np.int8(Fate.GATED),
            np.int8(Fate.TRIMMED),
            np.int8(Fate.NO_LINE),
            np.int8(Fate.DOWN_WEIGHTED),
        ],
        default=np.int8(Fate.KEPT),
    )


@dataclass(frozen=True, kw_only=True)
class PairStyle:
    """How pairs of one fate look: apart in colour, in line style and in marker."""

    color: str
    dash: str
    marker: str
    size: float
    filled: bool = False
    width: float = 1.0


STYLES = {
    Fate.GATED: PairStyle(color=VERMILLION, dash=":", marker="x", size=4.5),
    Fate.TRIMMED: PairStyle(color=ORANGE, dash="--", marker="s", size=4.0),
    Fate.NO_LINE: PairStyle(color=GREY, dash="-.", marker="D", size=3.5),
    Fate.DOWN_WEIGHTED: PairStyle(color=GREEN, dash="-.", marker="^", size=4.5, filled=True),
    Fate.KEPT: PairStyle(color=BLUE, dash="-", marker="o", size=2.6, filled=True),
}


class PairArtists:
    """Pairs on an axes, to be set as often as one likes.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    shown : sequence of Fate
        The fates that get artists, and an entry in the legend.
    """

    def __init__(self, ax: Axes, shown: Sequence[Fate]) -> None:
        self.lines: dict[Fate, LineCollection] = {}
        self.points: dict[Fate, Line2D] = {}
        for fate in shown:
            style = STYLES[fate]
            self.lines[fate] = LineCollection(
                [], colors=style.color, linestyles=style.dash, linewidths=style.width, zorder=2.2
            )
            ax.add_collection(self.lines[fate], autolim=False)
            (self.points[fate],) = ax.plot(
                [],
                [],
                linestyle="none",
                marker=style.marker,
                markersize=style.size,
                markerfacecolor=style.color if style.filled else "none",
                markeredgecolor=style.color,
                markeredgewidth=0.0 if style.filled else 0.9,
                zorder=2.6 if fate >= Fate.DOWN_WEIGHTED else 2.4,
            )

    def update(self, pairs: Correspondences) -> None:
        """Show `pairs`."""
        fate_of = fates(pairs)
        segments = np.stack([pairs.source, pairs.target], axis=1)
        for fate, lines in self.lines.items():
            chosen = fate_of == fate
            lines.set_segments(list(segments[chosen]))
            self.points[fate].set_data(*pairs.source[chosen].T)
            self.points[fate].set_label(f"{fate.label}: {np.count_nonzero(chosen)}")

    def legend_handles(self) -> list[Line2D]:
        """One entry for each fate, with its line, its marker and its count."""
        handles = []
        for fate, points in self.points.items():
            handle = Line2D([], [], label=str(points.get_label()))
            handle.update_from(points)
            handle.set(linestyle=STYLES[fate].dash, linewidth=1.2, color=STYLES[fate].color)
            handle.set(
                markerfacecolor=points.get_markerfacecolor(),
                markeredgecolor=points.get_markeredgecolor(),
            )
            handles.append(handle)
        return handles


def plot_correspondences(ax: Axes, target: Scan | ArrayLike, pairs: Correspondences) -> Axes:
    """Draw each pair as a line from the moved source point to its target point.

    Line and marker tell the pair's fate, see `labkit.plotting.fates`; the legend counts
    each of them. "no line" appears only where it happened.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    target : Scan or array_like, shape (M, 2)
        The older scan [m].
    pairs : Correspondences
        The association, which holds the source where it was matched. One from afar holds
        every so many-th point.

    Returns
    -------
    Axes
        The `ax` given.

    Raises
    ------
    InvalidPointsError
        For a target that cannot be meant.

    Examples
    --------
    >>> import labkit
    >>> from labkit.plotting import book_figure
    >>> target = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0]]
    >>> source = [[0.1, 0.0], [4.1, 0.0], [0.1, 3.0], [4.9, 3.0]]
    >>> pairs = labkit.icp(source, target).correspondences
    >>> ax = plot_correspondences(book_figure().subplots(), target, pairs)
    >>> [text.get_text() for text in ax.get_legend().get_texts()][1:3]
    ['gated: 1', 'trimmed: 0']
    """
    drawn_target = draw_target(ax, scan_points(target, "target"))
    occurring = set(np.unique(fates(pairs)).tolist())
    shown = [fate for fate in Fate if fate is not Fate.NO_LINE or fate in occurring]
    artists = PairArtists(ax, shown)
    artists.update(pairs)
    ax.relim()
    ax.autoscale_view()
    style_plane(ax)
    ax.set_title(f"{pairs.inlier_count} of {len(pairs.kept)} pairs are inliers")
    legend_below(ax, [drawn_target, *artists.legend_handles()])
    return ax
