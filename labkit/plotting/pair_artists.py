"""The artists of a set of pairs: for each fate a bundle of lines and its source points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from labkit.arrays import FloatArray
from labkit.correspondences import Correspondences
from labkit.plotting.fates import Fate, fates
from labkit.plotting.style import BLUE, GREEN, GREY, ORANGE, VERMILLION


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

    def update(self, moved: FloatArray, target: FloatArray, pairs: Correspondences) -> None:
        """Show `pairs` of the source where it is now, shape (N, 2), and the target (M, 2)."""
        moved, fate_of = moved[:: pairs.every], fates(pairs)
        segments = np.stack([moved, target[pairs.target_index]], axis=1)
        for fate, lines in self.lines.items():
            chosen = fate_of == fate
            lines.set_segments(list(segments[chosen]))
            self.points[fate].set_data(*moved[chosen].T)
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
