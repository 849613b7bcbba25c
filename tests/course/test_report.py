"""A report's tables and figures: what is in them, and that no parameter goes without a reason."""

import math

import numpy as np
import pytest

import labkit
from labkit.course.report import (
    UNANSWERED,
    error_table,
    figure_with_text,
    parameter_table,
    quality_table,
)
from labkit.filters import Preprocessing
from labkit.odometry import Decision, OdometryParameters, SanityLimits, StepRecord
from labkit.support.errors import InvalidParameterError


def cells(table):
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.split("\n")]


def test_a_choice_without_a_reason_is_asked_for_one():
    chosen = labkit.IcpParameters(overlap_ratio=0.7, huber_delta=math.inf)
    rows = cells(parameter_table(chosen, {"overlap_ratio": "a crowd"}))[2:]
    assert rows == [
        ["`overlap_ratio`", "0.7", "0.85", "a crowd"],
        ["`huber_delta`", "off", "0.2 m", UNANSWERED],
    ]


@pytest.mark.parametrize(
    ("reason", "written"),
    [
        ("residuals |r| > 0.1 m are few", r"residuals \|r\| > 0.1 m are few"),
        ("few have $|r| > 0.1$ m | so", r"few have $\vert r\vert  > 0.1$ m \| so"),
        (r"$\|r\| > 0.1$", r"$\|r\| > 0.1$"),
        ("a crowd\nstands there", "a crowd stands there"),
        ("costs $5 | more", r"costs $5 \| more"),
    ],
)
def test_no_reason_breaks_its_table(reason, written):
    table = parameter_table(labkit.IcpParameters(huber_delta=0.1), {"huber_delta": reason})
    assert table.split("\n")[2:] == [f"| `huber_delta` | 0.1 m | 0.2 m | {written} |"]


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [
        ("max_correspondence_distance", 1, "1 m"),
        ("max_correspondence_distance", np.float32(0.25), "0.25 m"),
        ("max_iterations", 1000000, "1000000"),
    ],
)
def test_a_number_of_any_kind_has_its_unit(name, value, shown):
    rows = cells(parameter_table(labkit.IcpParameters(**{name: value})))
    assert rows[2][:2] == [f"`{name}`", shown]


def test_parameters_within_parameters_are_listed():
    chosen = OdometryParameters(
        limits=SanityLimits(max_rmse=0.3), preprocessing=Preprocessing(range_max=8.0)
    )
    names = [row[0] for row in cells(parameter_table(chosen))[2:]]
    assert names == ["`max_rmse`", "`range_max`"]


@pytest.mark.parametrize(
    ("parameters", "reasons", "message"),
    [
        (labkit.IcpParameters(), {"gate": "x"}, r"got 'gate'; there are .*overlap_ratio"),
        ({"gate": 1}, None, r"must be a parameter object such as IcpParameters\(\), got {'gate"),
        (labkit.IcpParameters, None, "must be a parameter object"),
    ],
)
def test_what_is_no_parameter_is_refused(parameters, reasons, message):
    with pytest.raises(InvalidParameterError, match=message):
        parameter_table(parameters, reasons)


def test_errors_are_those_of_the_evaluation():
    reference = np.array([[x, 0.0, 0.0] for x in np.linspace(0, 20, 41)])
    estimate = reference * [1.1, 1.0, 1.0]
    rows = cells(error_table({"odometry": estimate}, reference))
    shown = ["RPE a step", "RPE over 10 m", "ATE"]
    assert [row[0] for row in rows[2:]] == [f"odometry, {error}" for error in shown]
    assert rows[2][1:] == ["0.050, 0.050, 0.050", "0.00, 0.00, 0.00"]
    assert rows[3][1] == "1.000, 1.000, 1.000"


def test_a_path_too_short_for_a_stretch_has_no_error():
    rows = cells(error_table({"a": [[0, 0, 0], [1, 0, 0]]}, [[0, 0, 0], [1, 0, 0]]))
    assert rows[3] == ["a, RPE over 10 m", "none", "none"]


def record(**values):
    return StepRecord(increment=np.zeros(3), decision=Decision.ICP, **values)


def test_quality_counts_decisions_and_takes_percentiles_of_what_has_a_number():
    ended = labkit.Termination.CONVERGED_POSE
    steps = [record(rmse=each, inlier_count=100, termination=ended) for each in (0.01, 0.02, 0.06)]
    steps.append(record(rmse=math.nan))
    table = cells(
        quality_table([StepRecord(increment=np.zeros(3), decision=Decision.START), *steps])
    )
    assert table[2][1] == "4: 4 icp"
    assert ["inlier RMSE [m]", "0.020", "0.011 to 0.056"] in table
    assert ["inliers", "100", "100 to 100"] in table


def test_a_figure_of_a_report_has_a_text_for_those_who_cannot_see_it():
    figure = labkit.plotting.book_figure(1.0)

    page = figure_with_text(figure, 'A map, "dashed" where a < b')._repr_html_()

    assert 'alt="A map, &quot;dashed&quot; where a &lt; b"' in page
    assert 'src="data:image/png;base64,iVBOR' in page
