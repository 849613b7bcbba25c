"""The look that all figures share: one colour language, the book's width, legends below the axes.

The meaning of a colour is defined here alone. `css_variables` hands it to pages and widgets.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.transforms import ScaledTranslation

from labkit.support.arrays import check_range

# The palette of Okabe and Ito, told apart by colour-blind readers:
# https://jfly.uni-koeln.de/color/
BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#8C8C8C"

COLORS = {  # by meaning: on a light ground, on a dark one
    "target": (BLACK, "#FFFFFF"),
    "source": (BLUE, SKY),
    "kept": (BLUE, SKY),  # the fates of a pair: the source's hue and its neighbours
    "down": ("#00747D", "#3CC6CF"),
    "trimmed": ("#6F57AE", "#B3A1F0"),
    "gated": ("#A0468C", "#E58FD0"),
    "noline": ("#737373", "#9A9A9A"),
    "reference": ("#767676", "#A0A0A0"),  # dashed
    "method-1": (VERMILLION, "#FF8B3D"),
    "method-2": (GREEN, "#35C79C"),
}
TARGET, SOURCE, KEPT, DOWN_WEIGHTED, TRIMMED, GATED, NO_LINE, REFERENCE, *METHODS = (
    light for light, _ in COLORS.values()
)
_GROUND = {  # of the widgets, by part: the light one, the dark one
    "ink": ("#12212e", "#e6edf3"),
    "soft": ("#55606b", "#a9b4bf"),
    "grid": ("#e4e8ec", "#33404c"),
    "paper": ("#ffffff", "#14181e"),
    "scheme": ("light", "dark"),
}
_DARK = (  # the marks of a dark theme in pages, JupyterLab, Colab and VS Code
    "html:is([data-theme=dark], [theme=dark]), body:is([data-jp-theme-light=false], .vscode-dark, "
    ".vscode-high-contrast:not(.vscode-high-contrast-light))"
)

BOOK_WIDTH = 7.0  # [in]: 700 px at 100 dpi
BOOK_DPI = 100
_LEGEND_DISTANCE = 34.0 / 72.0  # [in] below the axes: clears ticks and label
_ENTRY_WIDTH = 0.5  # [in] of a legend's entry without its text
_LETTER_WIDTH = 0.065  # [in]


def css_variables() -> str:
    """Colours as variables of a style sheet, ``--icp-source`` and so on, light and dark."""
    colors = COLORS | _GROUND
    light = " ".join(f"--icp-{name}: {color};" for name, (color, _) in colors.items())
    dark = " ".join(f"--icp-{name}: {color};" for name, (_, color) in colors.items())
    return f":root {{ {light} }}\n{_DARK} {{ {dark} }}\n"


class BookFigure(Figure):
    """A figure whose axes look alike: a faint grid, no frame above and to the right."""

    def add_subplot(self, *args: Any, **kwargs: Any) -> Axes:
        """Add axes as matplotlib does; `subplots` makes each of its axes by this."""
        ax: Axes = super().add_subplot(*args, **kwargs)
        ax.set_prop_cycle(color=[*METHODS, GREY])
        style_grid(ax)
        return ax


def book_figure(height: float = 4.5) -> Figure:
    """An empty figure as wide as the book's page (700 px), `height` inches high.

    It belongs to no pyplot, so nothing is left open.
    """
    check_range(height, "height", above=0.0, at_most=50.0, unit="in")
    figure = BookFigure(figsize=(BOOK_WIDTH, height), dpi=BOOK_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def style_plane(ax: Axes) -> None:
    """Make `ax` a map of the plane: one metre as long in x as in y."""
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    style_grid(ax)


def style_grid(ax: Axes) -> None:
    """Put a faint grid behind the data and take away the frame's upper and right side."""
    ax.grid(color="0.9", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def legend_below(ax: Axes, handles: Sequence[Artist] | None = None) -> Legend:
    """Put a legend under the label of the axes, where it hides no data, in columns that fit."""
    figure = ax.get_figure()
    assert figure is not None
    below = ax.transAxes + ScaledTranslation(0.0, -_LEGEND_DISTANCE, figure.dpi_scale_trans)
    entries = ax.get_legend_handles_labels()[0] if handles is None else handles
    longest_label = max((len(str(entry.get_label())) for entry in entries), default=1)
    width = ax.get_position(original=True).width * figure.bbox.width / figure.dpi
    columns = max(1, int(width / (_ENTRY_WIDTH + _LETTER_WIDTH * longest_label)))
    return ax.legend(
        handles=entries,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=below,
        ncols=min(columns, max(1, len(entries))),
        edgecolor="none",
        framealpha=1.0,
        borderaxespad=0.0,
        columnspacing=1.6,
        handlelength=2.6,
        markerscale=1.3,
    )
