"""Convergence: cost and steps, iteration by iteration."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from labkit.plotting.style import METHODS, SOURCE, legend_below, style_grid
from labkit.result import IcpResult
from labkit.support.arrays import check_kind

_TITLE_WIDTH = 66  # letters of a title across the book's page
_SMALLEST_SHOWN = 1e-7  # of the greatest value: the log scale ends there
_STYLES: dict[str, dict[str, Any]] = {  # by the field of an iteration
    "cost": {"label": "cost J", "color": SOURCE, "marker": "o"},
    "translation_step": {"color": METHODS[0], "marker": "^", "linestyle": "--"},
    "rotation_step": {"color": METHODS[1], "marker": "s", "linestyle": ":"},
}


def plot_convergence(ax: Axes, result: IcpResult, step_ax: Axes) -> Axes:
    """Draw cost and step sizes over the iterations; the title says how the run ended.

    Parameters
    ----------
    ax : Axes
        For the cost J [m²], on a log scale, which ends at 1e-7 of its greatest value.
    result : IcpResult
        The run.
    step_ax : Axes
        For the steps, [m] and [rad], on a log scale as well.
    """
    check_kind(ax, "ax", Axes)
    check_kind(result, "result", IcpResult)
    check_kind(step_ax, "step_ax", Axes)
    _draw_curves(ax, result, ("cost",), "cost J [m²]")
    _draw_curves(step_ax, result, ("translation_step", "rotation_step"), "step [m] or [rad]")
    if ax.get_shared_x_axes().joined(ax, step_ax):
        ax.set_xlabel("")
    legend_below(step_ax)
    count = result.iterations
    ending = textwrap.fill(result.message, _TITLE_WIDTH)
    ax.set_title(f"{count} iteration{'' if count == 1 else 's'}\n{ending}")
    return ax


def _draw_curves(ax: Axes, result: IcpResult, names: tuple[str, ...], ylabel: str) -> None:
    """Draw fields of the iterations, by name, on a log scale."""
    rows = [[getattr(iteration, name) for name in names] for iteration in result.history]
    values = np.array(rows)
    for name, curve in zip(names, values.T, strict=False):
        style = {"label": name.replace("_", " ")} | _STYLES[name]
        ax.plot(curve, markersize=4.5, linewidth=1.4, **style)
    greatest = np.max(values, initial=0.0, where=np.isfinite(values))
    if greatest > 0.0:
        ax.set_yscale("log")
        ax.set_ylim(bottom=max(_SMALLEST_SHOWN * greatest, ax.get_ylim()[0]))
    ax.set_xlim(-0.4, max(len(values), 1) - 0.6)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    ax.set_xlabel("iteration")
    ax.set_ylabel(ylabel)
    style_grid(ax)
