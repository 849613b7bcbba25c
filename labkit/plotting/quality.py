"""The signals to log of each step (section 5), over the whole run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from scipy.ndimage import median_filter

from labkit.line_alignment import MIN_INFORMATION
from labkit.odometry import Decision, SanityLimits, StepRecord
from labkit.plotting.style import GREEN, GREY, ORANGE, PURPLE, SKY, SOURCE, VERMILLION, style_grid
from labkit.support.arrays import FloatArray
from labkit.support.errors import InvalidPointsError

FALLBACKS = {  # decision: colour, marker
    Decision.RETRY: (ORANGE, "^"),
    Decision.SEARCH: (SKY, "P"),
    Decision.PRIOR: (VERMILLION, "X"),
    Decision.HOLD: (PURPLE, "s"),
    Decision.STAND: (GREEN, "D"),
}
SIGNALS = {"rmse": "m", "inlier_ratio": "–", "rotation": "°", "information": "–"}
_MARGIN = 0.06  # of the greatest value, below 0 and above it: a mark there stays whole
_MEDIAN_SHARE = 80  # the running median looks at one part in so many of the run,
_MEDIAN_STEPS = 15  # but at so many steps at least


def plot_quality(
    figure: Figure | SubFigure,
    records: Sequence[StepRecord],
    *,
    limits: SanityLimits | None = None,
) -> tuple[Axes, ...]:
    """Draw RMSE, inlier ratio, rotation, information and decisions over a run.

    Every step is a grey dot, the blue line a running median. A step that fell back
    carries the mark of its decision in each panel that has a number for it, and in the
    lowest panel always.

    Parameters
    ----------
    figure : Figure or SubFigure
        An empty one; about 7 × 7 inches suit a page.
    records : sequence of StepRecord, length K
        The steps of an `OdometryResult`.
    limits : SanityLimits, optional
        The limits that the steps were held to: dashed lines.

    Returns
    -------
    tuple of 5 Axes
        RMSE [m], inlier ratio, rotation [°], information, decisions.
    """
    if len(records) == 0:
        raise InvalidPointsError("`records` is empty, got 0 steps; it needs at least 1")
    at = np.arange(len(records), dtype=np.float64)
    decisions = [record.decision for record in records]
    axes = tuple(figure.subplots(5, 1, sharex=True, height_ratios=[3, 3, 3, 3, 2]))
    for ax, (name, unit) in zip(axes, SIGNALS.items(), strict=False):
        values = np.array([getattr(record, name) for record in records], dtype=np.float64)
        _draw_signal(ax, at, np.degrees(values) if unit == "°" else values, decisions)
        ax.set_ylabel(f"{'RMSE' if name == 'rmse' else name.replace('_', ' ')} [{unit}]")
    if limits is not None:
        _draw_limits(axes, limits)
    _draw_decisions(axes[-1], at, decisions)
    axes[-1].set_xlabel("step")
    steps = len(decisions) - decisions.count(Decision.START)
    fell = sum(each in FALLBACKS for each in decisions)
    axes[0].set_title(f"Quality of {steps:,} steps, {fell:,} of them fell back")
    figure.align_ylabels(axes)
    return axes


def _draw_signal(
    ax: Axes, at: FloatArray, values: FloatArray, decisions: Sequence[Decision]
) -> None:
    ax.plot(at, values, ".", color=GREY, markersize=2.6, markeredgewidth=0, rasterized=True)
    known = np.isfinite(values)
    window = max(_MEDIAN_STEPS, len(values) // _MEDIAN_SHARE)
    if np.count_nonzero(known) > window:
        ax.plot(
            at[known], median_filter(values[known], window, mode="nearest"), color=SOURCE, lw=1.2
        )
    for decision, (color, marker) in FALLBACKS.items():
        fell = np.array([each is decision for each in decisions]) & known
        if fell.any():
            look: dict[str, Any] = {"markeredgecolor": "white", "markeredgewidth": 0.5}
            ax.plot(at[fell], values[fell], marker, color=color, markersize=7.0, **look)
    greatest = float(values[known].max(initial=0.0))
    _show_from_zero(ax, (1.0 + _MARGIN) * greatest or ax.get_ylim()[1])
    style_grid(ax)


def _draw_limits(axes: Sequence[Axes], limits: SanityLimits) -> None:
    """Dashed lines; the view is stretched to show one that the data come near to."""
    bounds = limits.max_rmse, limits.min_inlier_ratio, np.degrees(limits.max_rotation)
    for ax, bound in zip(axes, (*bounds, MIN_INFORMATION), strict=False):
        top = ax.get_ylim()[1]
        ax.axhline(bound, color="black", linestyle="--", linewidth=0.9)
        _show_from_zero(ax, max(top, 1.08 * bound) if bound < 2.0 * top else top)


def _show_from_zero(ax: Axes, top: float) -> None:
    ax.set_ylim(-_MARGIN * top, top)


def _draw_decisions(ax: Axes, at: FloatArray, decisions: Sequence[Decision]) -> None:
    """A row for ICP and for each fallback that occurred; a tick for each step in it."""
    shown = [Decision.ICP, *(each for each in FALLBACKS if each in decisions)]
    for row, decision in enumerate(shown):
        here = at[[each is decision for each in decisions]]
        if decision is Decision.ICP:
            ax.plot(here, np.full(len(here), row), "|", color=GREY, markersize=5, rasterized=True)
        else:
            color, marker = FALLBACKS[decision]
            ax.plot(here, np.full(len(here), row), marker, color=color, markersize=6)
        ax.text(1.01, row, f"{len(here):,}", transform=ax.get_yaxis_transform(), va="center")
    ax.set_yticks(range(len(shown)), [decision.value for decision in shown])
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.set_ylabel("decision")
    style_grid(ax)
