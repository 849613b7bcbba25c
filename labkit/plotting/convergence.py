"""Convergence: cost and steps, iteration by iteration."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from labkit.plotting.style import METHODS, SOURCE, TARGET, legend_below, style_grid
from labkit.result import IcpResult
from labkit.support.arrays import FloatArray

_TITLE_WIDTH = 66  # characters of a title across the book's page
_FLOOR = 1e-7  # of the greatest value: what is smaller would only stretch the scale
_STYLES: dict[str, dict[str, Any]] = {
    "cost J": {"color": SOURCE, "marker": "o"},
    "translation step": {"color": METHODS[0], "marker": "^", "linestyle": "--"},
    "rotation step": {"color": METHODS[1], "marker": "s", "linestyle": ":"},
}


def plot_convergence(ax: Axes, result: IcpResult, step_ax: Axes | None = None) -> Axes:
    """Draw cost and step sizes over the iterations; the title says how the run ended.

    Parameters
    ----------
    ax : Axes
        For the cost J [m²], on a log scale; what is less than 1e-7 of its greatest value is
        marked at the foot.
    step_ax : Axes, optional
        For the steps, [m] and [rad]; by default a second y-axis at the right of `ax`.
    """
    lower = ax.twinx() if step_ax is None else step_ax
    cost, moved, turned = (
        np.array([getattr(each, name) for each in result.history])
        for name in ("cost", "translation_step", "rotation_step")
    )
    costs = _draw(ax, "cost", {"cost J": cost})
    steps = _draw(lower, "step", {"translation step": moved, "rotation step": turned})
    ax.set_ylabel("cost J [m²]")
    lower.set_ylabel("step [m] or [rad]")
    for each in (ax, lower):
        style_grid(each)
        each.set_xlim(-0.4, len(cost) - 0.6)
        each.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        each.set_xlabel("iteration")
    if step_ax is None:
        lower.grid(visible=False)
        lower.spines["right"].set_visible(True)
        legend_below(ax, costs + steps)
    else:
        if ax.get_shared_x_axes().joined(ax, step_ax):
            ax.set_xlabel("")
        legend_below(step_ax, steps)
    count = result.iterations
    ended = textwrap.fill(result.message, _TITLE_WIDTH)
    ax.set_title(f"{count} iteration{'' if count == 1 else 's'}\n{ended}")
    return ax


def _draw(ax: Axes, what: str, curves: dict[str, FloatArray]) -> list[Line2D]:
    """Curves on one log scale, their legend entries; what is as good as 0 at its foot."""
    top = max(np.max(values, initial=0.0, where=values > 0.0) for values in curves.values())
    if top > 0.0:
        ax.set_yscale("log")
    elif not any(np.isfinite(values).any() for values in curves.values()):
        ax.set_yticks([])  # a run that took no step
    floor = _FLOOR * top
    entries = []
    for name, values in curves.items():
        style = _STYLES[name]
        shown = np.where(values < floor, floor, values)
        entries += ax.plot(shown, label=name, markersize=4.5, linewidth=1.4, **style)
    tiny = [np.flatnonzero(values < floor) for values in curves.values()]
    if any(map(len, tiny)):
        at = np.unique(np.concatenate(tiny))
        foot = np.full(len(at), floor)
        label = f"{what} below the scale"
        entries += ax.plot(at, foot, "v", markersize=7.0, color=TARGET, label=label)
    return entries
