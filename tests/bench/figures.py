"""The figure of the benchmark's page; marks tell matchers apart without colour."""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from labkit.plotting.style import BLACK, BLUE, GREY, book_figure, style_grid

COLUMNS = 2
PANEL, LEGEND = 2.35, 1.1  # inches
MARKS = ("s", "^", "v", "D", "P", "X", "<", ">", "*", "h", "p", "8", "d")
TICKS = (1.0, 2.0, 5.0)  # of each decade


def matcher_styles(names: list[str]) -> dict[str, dict[str, Any]]:
    """A mark for each matcher; labkit's own are filled."""
    peers = [name for name in names if not _own(name)]
    styles: dict[str, dict[str, Any]] = {}
    for name in names:
        own = _own(name)
        index = 0 if own else peers.index(name)
        color = (BLUE if "line" in name else BLACK) if own else GREY
        styles[name] = {
            "marker": ("o" if "line" in name else "s") if own else MARKS[index % len(MARKS)],
            "color": color,
            "markerfacecolor": color if own else "white",
            "markeredgecolor": color if own else BLACK,
            "markersize": 8.0 if own else 6.5,
            "linestyle": "none",
            "zorder": 3.0 if own else 2.0,
        }
    return styles


def error_time_figure(results: dict[str, Any]) -> Figure:
    """Median error against median time, a panel for each set: lower left is better.

    A matcher too slow to see every pair is left to the tables.
    """
    sets = list(results["sets"].values())
    every = matcher_styles(_names(results))
    styles = {name: every[name] for each in sets for name in every if _saw_all(each, name)}
    rows = math.ceil(len(sets) / COLUMNS)
    figure = book_figure(rows * PANEL + LEGEND)
    axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for ax, each in zip(axes, sets, strict=False):
        for name, score in each["matchers"].items():
            error = score["translation_mm"]["median"]
            if name in styles and error is not None:
                ax.plot(score["time_ms"]["median"], error, **styles[name])
        _log_axes(ax)
        ax.set_title(each["title"], fontsize="medium")
        ax.set_xlabel("time [ms a pair]")
        ax.set_ylabel("error [mm]")
    for ax in axes[len(sets) :]:
        ax.set_visible(False)
    _legend(figure, styles)
    return figure


def _names(results: dict[str, Any]) -> list[str]:
    names: dict[str, None] = {}
    for each in results["sets"].values():
        names |= dict.fromkeys(each["matchers"])
    return list(names)


def _saw_all(result: dict[str, Any], name: str) -> bool:
    score = result["matchers"].get(name)
    return score is not None and score["pairs"] == result["pairs"]


def _own(name: str) -> bool:
    return name.startswith("labkit")


def _log_axes(ax: Axes) -> None:
    """Logarithmic, with plain numbers at 1, 2 and 5 of each decade."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=TICKS))
        axis.set_major_formatter(StrMethodFormatter("{x:,g}"))
        axis.set_minor_locator(NullLocator())
    style_grid(ax)


def _legend(figure: Figure, styles: dict[str, dict[str, Any]]) -> None:
    """One legend for all panels, below them."""
    handles = [Line2D([], [], label=name, **style) for name, style in styles.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
