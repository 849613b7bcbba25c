"""The look that all figures share: one colour language, the book's width, legends below the axes.

What a colour means stands here alone. `css_variables` tells it to the pages and the widgets.
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

COLORS = {  # what it stands for: on a light ground, on a dark one
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
_GROUND = {  # of the widgets, which stand on either
    "ink": ("#12212e", "#e6edf3"),
    "soft": ("#55606b", "#a9b4bf"),
    "grid": ("#e4e8ec", "#33404c"),
    "paper": ("#ffffff", "#14181e"),
    "scheme": ("light", "dark"),
}
_DARK = (  # how pages, JupyterLab, Colab and VS Code mark it
    "html:is([data-theme=dark], [theme=dark]), body:is([data-jp-theme-light=false], .vscode-dark, "
    ".vscode-high-contrast:not(.vscode-high-contrast-light))"
)

BOOK_WIDTH = 7.0  # inches: 700 px at 100 dpi
BOOK_DPI = 100
_BELOW_LABEL = 34.0  # points from the axes to a legend that clears ticks and label
_ENTRY, _LETTER = 0.5, 0.065  # inches that an entry takes in a legend, and a letter of it


def css_variables() -> str:
    """The colours as variables of a style sheet, ``--icp-source`` and so on, light and dark."""
    told = COLORS | _GROUND
    light, dark = (
        " ".join(f"--icp-{name}: {pair[ground]};" for name, pair in told.items())
        for ground in (0, 1)
    )
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
    """A legend under the axes' label, where it hides no data, in as many columns as fit."""
    figure = ax.get_figure()
    assert figure is not None
    below = ax.transAxes + ScaledTranslation(0.0, -_BELOW_LABEL / 72.0, figure.dpi_scale_trans)
    found = ax.get_legend_handles_labels()[0] if handles is None else handles
    longest = max((len(str(handle.get_label())) for handle in found), default=1)
    width = ax.get_position(original=True).width * figure.bbox.width / figure.dpi
    columns = max(1, int(width / (_ENTRY + _LETTER * longest)))
    return ax.legend(
        handles=found,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=below,
        ncols=min(columns, max(1, len(found))),
        edgecolor="none",
        framealpha=1.0,
        borderaxespad=0.0,
        columnspacing=1.6,
        handlelength=2.6,
        markerscale=1.3,
    )
