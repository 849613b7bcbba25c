"""The signals to log of each step (section 5), over the whole run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from scipy.ndimage import median_filter

from labkit.line_alignment import MIN_INFORMATION
from labkit.odometry import Decision, SanityLimits, StepRecord
from labkit.plotting.style import GREEN, GREY, ORANGE, PURPLE, SKY, SOURCE, VERMILLION, style_grid
from labkit.support.arrays import FloatArray, check_kind
from labkit.support.errors import InvalidPointsError

FALLBACKS = {  # decision: colour, marker
    Decision.RETRY: (ORANGE, "^"),
    Decision.SEARCH: (SKY, "P"),
    Decision.PRIOR: (VERMILLION, "X"),
    Decision.HOLD: (PURPLE, "s"),
    Decision.STAND: (GREEN, "D"),
}
SIGNALS = {  # of a record: the label, and the field of the limits, if it is one
    "rmse": ("RMSE [m]", "max_rmse"),
    "inlier_ratio": ("inlier ratio [–]", "min_inlier_ratio"),
    "rotation": ("rotation [°]", "max_rotation"),
    "information": ("information [–]", ""),
}
_MARGIN = 0.06  # of the greatest value, below 0 and above it: a mark there stays whole
_MEDIAN_SHARE = 80  # the running median looks at one part in so many of the run,
_MEDIAN_STEPS = 15  # but at so many steps at least


def plot_quality(
    figure: Figure | SubFigure, records: Sequence[StepRecord], *, limits: SanityLimits
) -> tuple[Axes, ...]:
    """Draw RMSE, inlier ratio, rotation, information and decisions over a run: five axes.

    Every step is a grey dot, the blue line a running median. A step that fell back
    carries the mark of its decision in each panel that has a number for it, and in the
    lowest panel always.

    Parameters
    ----------
    figure : Figure or SubFigure
        An empty one; about 7 × 7 inches suit a page.
    records : sequence of StepRecord, length K
        The steps of an `OdometryResult`.
    limits : SanityLimits
        The limits that the steps were held to: dashed lines.
    """
    check_kind(limits, "limits", SanityLimits)
    if len(records) == 0:
        raise InvalidPointsError("`records` is empty, got 0 steps; it needs at least 1")
    at = np.arange(len(records), dtype=np.float64)
    decisions = [record.decision for record in records]
    axes = tuple(figure.subplots(5, 1, sharex=True, height_ratios=[3, 3, 3, 3, 2]))
    for ax, (name, (label, bound)) in zip(axes, SIGNALS.items(), strict=False):
        values = np.array([getattr(record, name) for record in records], dtype=np.float64)
        limit = getattr(limits, bound) if bound else MIN_INFORMATION
        scale = np.degrees(1.0) if name == "rotation" else 1.0
        _draw_signal(ax, at, scale * values, decisions, scale * limit)
        ax.set_ylabel(label)
    _draw_decisions(axes[-1], at, decisions)
    axes[-1].set_xlabel("step")
    steps = len(decisions) - decisions.count(Decision.START)
    fell = sum(each in FALLBACKS for each in decisions)
    axes[0].set_title(f"Quality of {steps:,} steps, {fell:,} of them fell back")
    figure.align_ylabels(axes)
    return axes


def _draw_signal(
    ax: Axes, at: FloatArray, values: FloatArray, decisions: Sequence[Decision], limit: float
) -> None:
    """Dots, running median, fallbacks and, dashed, the limit, in view if the data come near it."""
    ax.plot(at, values, ".", color=GREY, markersize=2.6, markeredgewidth=0, rasterized=True)
    known = np.isfinite(values)
    window = max(_MEDIAN_STEPS, len(values) // _MEDIAN_SHARE)
    if np.count_nonzero(known) > window:
        median = median_filter(values[known], window, mode="nearest")
        ax.plot(at[known], median, color=SOURCE, lw=1.2)
    for decision, (color, marker) in FALLBACKS.items():
        fell = np.array([each is decision for each in decisions]) & known
        if fell.any():
            ax.plot(at[fell], values[fell], marker, color=color, ms=7.0, mec="white", mew=0.5)
    top = (1.0 + _MARGIN) * float(values[known].max(initial=0.0)) or 1.0
    ax.axhline(limit, color="black", linestyle="--", linewidth=0.9)
    top = max(top, 1.08 * limit) if limit < 2.0 * top else top
    ax.set_ylim(-_MARGIN * top, top)
    style_grid(ax)


def _draw_decisions(ax: Axes, at: FloatArray, decisions: Sequence[Decision]) -> None:
    """A row for ICP and for each fallback that occurred; a tick for each step in it."""
    shown = [Decision.ICP, *(each for each in FALLBACKS if each in decisions)]
    for row, decision in enumerate(shown):
        here = at[[each is decision for each in decisions]]
        color, marker = FALLBACKS.get(decision, (GREY, "|"))
        dense = decision is Decision.ICP
        ax.plot(here, np.full(len(here), row), marker, color=color, ms=6, rasterized=dense)
        ax.text(1.01, row, f"{len(here):,}", transform=ax.get_yaxis_transform(), va="center")
    ax.set_yticks(range(len(shown)), [decision.value for decision in shown])
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.set_ylabel("decision")
    style_grid(ax)
