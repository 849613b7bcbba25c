"""The panels of a run: each step a dot, each fallback a mark."""

import numpy as np
import pytest

from labkit.line_alignment import MIN_INFORMATION
from labkit.odometry import Decision, OdometryParameters, SanityLimits, StepRecord
from labkit.plotting import book_figure, plot_quality
from labkit.plotting.quality import FALLBACKS
from labkit.support.errors import InvalidParameterError

DECISIONS = [Decision.START, *[Decision.ICP] * 90, *FALLBACKS, *[Decision.ICP] * 5, Decision.PRIOR]
LIMITS = SanityLimits(max_rmse=0.15, min_inlier_ratio=0.3)
SIGNALS = ("rmse", "inlier_ratio", "rotation", "information")


def make_records(decisions=DECISIONS):
    """Steps with signals drawn at random; the start has none."""
    low = np.array([0.0, 0.8, 0.0, 0.0])
    drawn = np.random.default_rng(0).uniform(low, low + 0.1, (len(decisions), 4))
    drawn[0] = np.nan
    return [
        StepRecord(increment=np.zeros(3), decision=decision, **dict(zip(SIGNALS, row, strict=True)))
        for decision, row in zip(decisions, drawn, strict=True)
    ]


def marks(ax, decision):
    color, marker = FALLBACKS[decision]
    return [line for line in ax.lines if line.get_marker() == marker and line.get_color() == color]


def test_a_step_is_a_dot_a_limit_a_dashed_line_and_a_fallback_a_mark():
    """The last one, without a match, has its mark in the panel of decisions alone."""
    blank = StepRecord(increment=np.zeros(3), decision=Decision.HOLD)
    records = [*make_records(), blank]
    axes = plot_quality(book_figure(7.0), records, limits=LIMITS)
    signals = np.array([[getattr(each, name) for each in records] for name in SIGNALS])
    signals[2] = np.degrees(signals[2])
    bounds = (0.15, 0.3, 90.0, MIN_INFORMATION)
    for ax, values, bound in zip(axes, signals, bounds, strict=False):
        dots, limit = ax.lines[0], ax.lines[-1]
        np.testing.assert_array_equal(dots.get_xydata().T, [range(len(records)), values])
        assert limit.get_linestyle() == "--"
        np.testing.assert_allclose(limit.get_ydata(), bound)
    assert axes[0].get_ylim()[1] > 0.15
    assert axes[2].get_ylim()[1] < 20.0  # 90° would flatten what there is to see
    for decision in FALLBACKS:
        at = [k for k, each in enumerate(DECISIONS) if each is decision]
        for ax in axes[:4]:
            np.testing.assert_array_equal(marks(ax, decision)[0].get_xdata(), at)
        last = [len(DECISIONS)] if decision is Decision.HOLD else []
        np.testing.assert_array_equal(marks(axes[4], decision)[0].get_xdata(), [*at, *last])
    rows = [label.get_text() for label in axes[4].get_yticklabels()]
    assert rows == ["icp", "retry", "search", "prior", "hold", "stand"]
    assert [text.get_text() for text in axes[4].texts] == ["95", "1", "1", "2", "2", "1"]
    assert axes[0].get_title() == "Quality of 102 steps, 7 of them fell back"


def test_a_run_without_any_match():
    records = [StepRecord(increment=np.zeros(3), decision=Decision.STAND)] * 3
    figure = book_figure(7.0)
    plot_quality(figure, records, limits=LIMITS)
    figure.draw_without_rendering()
    with pytest.raises(InvalidParameterError, match="`limits` must be of the class SanityLimits"):
        plot_quality(book_figure(7.0), records, limits=OdometryParameters())


def test_the_line_is_a_running_median():
    records = make_records([Decision.START, *[Decision.ICP] * 60])
    dots, line, _ = plot_quality(book_figure(7.0), records, limits=LIMITS)[0].lines
    at, values = dots.get_xydata()[1:].T
    np.testing.assert_array_equal(line.get_xdata(), at)
    for k in range(7, 53):
        assert line.get_ydata()[k] == np.median(values[k - 7 : k + 8])
