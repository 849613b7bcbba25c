"""The panels of a run: each step a dot, each fallback a mark."""

import numpy as np
import pytest

from labkit.line_alignment import MIN_INFORMATION
from labkit.odometry import Decision, OdometryParameters, SanityLimits, StepRecord
from labkit.plotting import book_figure, plot_quality
from labkit.plotting.quality import FALLBACKS
from labkit.support.errors import LabkitError

DECISIONS = [Decision.START, *[Decision.ICP] * 90, *FALLBACKS, *[Decision.ICP] * 5, Decision.PRIOR]
LIMITS = SanityLimits(max_rmse=0.15, min_inlier_ratio=0.3)
LIMIT_LINES = {
    "rmse": 0.15,
    "inlier_ratio": 0.3,
    "rotation": 90.0,  # °
    "information": MIN_INFORMATION,
}


def make_records(decisions=DECISIONS):
    """Steps with signals drawn at random; the start has none."""
    lowest = np.array([0.0, 0.8, 0.0, 0.0])
    signals = np.random.default_rng(0).uniform(lowest, lowest + 0.1, (len(decisions), 4))
    signals[0] = np.nan
    return [
        StepRecord(
            increment=np.zeros(3), decision=decision, **dict(zip(LIMIT_LINES, row, strict=True))
        )
        for decision, row in zip(decisions, signals, strict=True)
    ]


@pytest.fixture(scope="module")
def drawn():
    """A run and its five axes; the last step, held without a match, has no signals."""
    records = [*make_records(), StepRecord(increment=np.zeros(3), decision=Decision.HOLD)]
    return records, plot_quality(book_figure(7.0), records, limits=LIMITS)


@pytest.mark.parametrize("panel", range(4))
def test_a_step_is_a_dot_and_a_limit_a_dashed_line(drawn, panel):
    records, axes = drawn
    name = list(LIMIT_LINES)[panel]
    values = np.array([getattr(record, name) for record in records])
    values = np.degrees(values) if name == "rotation" else values

    dots, limit = axes[panel].lines[0], axes[panel].lines[-1]

    np.testing.assert_array_equal(dots.get_xydata().T, [range(len(records)), values])
    np.testing.assert_allclose(limit.get_ydata(), LIMIT_LINES[name])
    assert limit.get_linestyle() == "--"


def test_a_limit_is_in_view_only_near_the_data(drawn):
    _, axes = drawn
    assert axes[0].get_ylim()[1] > 0.15
    assert axes[2].get_ylim()[1] < 20.0  # 90° would flatten what there is to see


@pytest.mark.parametrize("decision", FALLBACKS)
def test_a_fallback_has_its_mark_wherever_it_has_a_number(drawn, decision):
    records, axes = drawn
    color, marker = FALLBACKS[decision]
    steps = [k for k, record in enumerate(records) if record.decision is decision]
    with_number = [k for k in steps if np.isfinite(records[k].rmse)]

    for ax, expected in zip(axes, [*[with_number] * 4, steps], strict=True):
        (marks,) = (
            line for line in ax.lines if (line.get_marker(), line.get_color()) == (marker, color)
        )
        np.testing.assert_array_equal(marks.get_xdata(), expected)


def test_decisions_are_named_and_counted(drawn):
    _, axes = drawn
    rows = [label.get_text() for label in axes[4].get_yticklabels()]
    counts = [text.get_text() for text in axes[4].texts]

    assert rows == ["icp", "retry", "search", "prior", "hold", "stand"]
    assert counts == ["95", "1", "1", "2", "2", "1"]
    assert axes[0].get_title() == "Quality of 102 steps, 7 of them fell back"


def test_a_step_that_confirmed_the_wheels_has_a_row_and_is_no_fallback():
    records = make_records([Decision.START, *[Decision.ICP] * 5, Decision.CONFIRMED])

    axes = plot_quality(book_figure(7.0), records, limits=LIMITS)

    assert [label.get_text() for label in axes[4].get_yticklabels()] == ["icp", "confirmed"]
    assert axes[0].get_title() == "Quality of 6 steps, 0 of them fell back"


def test_a_run_without_any_match_is_drawn():
    records = [StepRecord(increment=np.zeros(3), decision=Decision.STAND)] * 3
    figure = book_figure(7.0)
    plot_quality(figure, records, limits=LIMITS)
    figure.draw_without_rendering()


@pytest.mark.parametrize(
    ("records", "limits", "message"),
    [
        (make_records(), OdometryParameters(), "`limits` must be of the class SanityLimits, got"),
        ([], LIMITS, "`records` is empty, got 0 steps"),
        ([None], LIMITS, r"`records\[0\]` must be of the class StepRecord, got None"),
    ],
)
def test_what_is_no_run_is_refused(records, limits, message):
    with pytest.raises(LabkitError, match=message):
        plot_quality(book_figure(7.0), records, limits=limits)


def test_the_line_is_a_running_median_of_15_steps():
    records = make_records([Decision.START, *[Decision.ICP] * 60])

    dots, line, _ = plot_quality(book_figure(7.0), records, limits=LIMITS)[0].lines

    steps, values = dots.get_xydata()[1:].T
    np.testing.assert_array_equal(line.get_xdata(), steps)
    for k in range(7, 53):
        assert line.get_ydata()[k] == np.median(values[k - 7 : k + 8])
