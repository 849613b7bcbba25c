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
from labkit.support.arrays import FloatArray, check_kind, check_kinds
from labkit.support.errors import InvalidPointsError

FALLBACKS = {  # decision: colour, marker
    Decision.RETRY: (ORANGE, "^"),
    Decision.SEARCH: (SKY, "P"),
    Decision.PRIOR: (VERMILLION, "X"),
    Decision.HOLD: (PURPLE, "s"),
    Decision.STAND: (GREEN, "D"),
}
SIGNALS = {  # field of a record: its label, and the field of its limit, if the limits have one
    "rmse": ("RMSE [m]", "max_rmse"),
    "inlier_ratio": ("inlier ratio [–]", "min_inlier_ratio"),
    "rotation": ("rotation [°]", "max_rotation"),
    "information": ("information [–]", ""),
}
_PANEL_MARGIN = 0.06  # below 0 and above the greatest value, relative to it: no mark is cut
_MEDIAN_SHARE = 80  # the running median spans 1/80 of the run,
_MIN_MEDIAN_STEPS = 15  # but no fewer steps than these


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
    check_kind(figure, "figure", Figure, SubFigure)
    check_kind(limits, "limits", SanityLimits)
    check_kinds(records, "records", StepRecord)
    if len(records) == 0:
        raise InvalidPointsError("`records` is empty, got 0 steps; it needs at least 1")
    steps = np.arange(len(records), dtype=np.float64)
    decisions = [record.decision for record in records]
    axes = tuple(figure.subplots(5, 1, sharex=True, height_ratios=[3, 3, 3, 3, 2]))
    for ax, (name, (label, limit_name)) in zip(axes, SIGNALS.items(), strict=False):
        values = np.array([getattr(record, name) for record in records], dtype=np.float64)
        limit = getattr(limits, limit_name) if limit_name else MIN_INFORMATION
        if name == "rotation":
            limit = limits.window[1]
        scale = np.degrees(1.0) if name == "rotation" else 1.0
        _draw_signal(ax, steps, scale * values, decisions, scale * limit)
        ax.set_ylabel(label)
    _draw_decisions(axes[-1], steps, decisions)
    axes[-1].set_xlabel("step")
    step_count = len(decisions) - decisions.count(Decision.START)
    fallback_count = sum(decision in FALLBACKS for decision in decisions)
    axes[0].set_title(f"Quality of {step_count:,} steps, {fallback_count:,} of them fell back")
    figure.align_ylabels(axes)
    return axes


def _draw_signal(
    ax: Axes, steps: FloatArray, values: FloatArray, decisions: Sequence[Decision], limit: float
) -> None:
    """Draw dots, running median and fallbacks, and the limit, in view if the data come near it."""
    ax.plot(steps, values, ".", color=GREY, markersize=2.6, markeredgewidth=0, rasterized=True)
    has_value = np.isfinite(values)
    window = max(_MIN_MEDIAN_STEPS, len(values) // _MEDIAN_SHARE)
    if np.count_nonzero(has_value) > window:
        median = median_filter(values[has_value], window, mode="nearest")
        ax.plot(steps[has_value], median, color=SOURCE, lw=1.2)
    for fallback, (color, marker) in FALLBACKS.items():
        chosen = has_value & [decision is fallback for decision in decisions]
        if chosen.any():
            (marks,) = ax.plot(steps[chosen], values[chosen], marker, color=color)
            marks.set(markersize=7.0, markeredgecolor="white", markeredgewidth=0.5)
    ax.axhline(limit, color="black", linestyle="--", linewidth=0.9)
    top = (1.0 + _PANEL_MARGIN) * float(values[has_value].max(initial=0.0)) or 1.0
    if limit < 2.0 * top:
        top = max(top, 1.08 * limit)
    ax.set_ylim(-_PANEL_MARGIN * top, top)
    style_grid(ax)


def _draw_decisions(ax: Axes, steps: FloatArray, decisions: Sequence[Decision]) -> None:
    """Draw a row for ICP and for each other decision, with a tick for each of its steps."""
    others = (Decision.CONFIRMED, *FALLBACKS)
    rows = [Decision.ICP, *(decision for decision in others if decision in decisions)]
    for row, row_decision in enumerate(rows):
        row_steps = steps[[decision is row_decision for decision in decisions]]
        color, marker = FALLBACKS.get(row_decision, (GREY, "|"))
        are_many = row_decision not in FALLBACKS
        height = np.full(len(row_steps), row)
        ax.plot(row_steps, height, marker, color=color, ms=6, rasterized=are_many)
        count = f"{len(row_steps):,}"
        ax.text(1.01, row, count, transform=ax.get_yaxis_transform(), va="center")
    ax.set_yticks(range(len(rows)), [decision.value for decision in rows])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_ylabel("decision")
    style_grid(ax)
