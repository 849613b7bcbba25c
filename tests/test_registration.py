"""Parameters that refuse nonsense, and results that do not contradict themselves."""

import math
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from labkit import IcpParameters, Termination
from labkit.arrays import homogeneous
from labkit.correspondences import Correspondences, point_rows
from labkit.errors import InvalidParameterError

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("name", "value", "interval"),
    [
        ("max_correspondence_distance", 0.0, "(0, inf] m"),
        ("max_correspondence_distance", -0.5, "(0, inf] m"),
        ("max_correspondence_distance", NAN, "(0, inf] m"),
        ("overlap_ratio", 0.0, "(0, 1]"),
        ("overlap_ratio", 1.3, "(0, 1]"),
        ("overlap_ratio", NAN, "(0, 1]"),
        ("huber_delta", 0.0, "(0, inf] m"),
        ("huber_delta", -0.2, "(0, inf] m"),
        ("huber_delta", "0.2", "(0, inf] m"),
        ("translation_tolerance", -1e-9, "[0, inf] m"),
        ("rotation_tolerance", -1e-9, "[0, inf] rad"),
        ("cost_tolerance", -1e-9, "[0, inf] m²"),
        ("cost_tolerance", None, "[0, inf] m²"),
        ("step_fraction", 0.0, "(0, 1]"),
        ("step_fraction", 1.5, "(0, 1]"),
        ("step_fraction", np.array([0.5, 0.6]), "(0, 1]"),
        ("overlap_ratio", True, "(0, 1]"),
        ("overlap_ratio", np.True_, "(0, 1]"),
        ("huber_delta", 0.2j, "(0, inf] m"),
    ],
)
def test_a_parameter_outside_its_range(name, value, interval):
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(**{name: value})
    assert str(caught.value) == f"`{name}` must be in {interval}, got {value!r}"


@pytest.mark.parametrize("budget", [0, -1, 2.5, 60.0, INF, NAN, "60", None, True, np.array([60])])
def test_a_budget_that_is_no_count(budget):
    message = f"`max_iterations` must be a whole number of at least 1, got {budget!r}"
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(max_iterations=budget)
    assert str(caught.value) == message


@pytest.mark.parametrize("metric", ["plane", "", None, 3, ["point_to_line"]])
def test_an_unknown_metric(metric):
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(metric=metric)
    message = f"`metric` must be one of point_to_point, point_to_line, got {metric!r}"
    assert str(caught.value) == message


def test_everything_can_be_turned_off():
    IcpParameters(
        max_correspondence_distance=INF,
        overlap_ratio=1.0,
        huber_delta=INF,
        max_iterations=np.int64(1),
        translation_tolerance=0.0,
        rotation_tolerance=0.0,
        cost_tolerance=0.0,
    )


def test_parameters_are_the_lessons_and_stay_so():
    parameters = IcpParameters()
    lesson = (
        parameters.max_correspondence_distance,
        parameters.overlap_ratio,
        parameters.huber_delta,
        parameters.max_iterations,
        parameters.metric,
    )
    assert lesson == (0.5, 0.85, 0.20, 60, "point_to_point")
    with pytest.raises(FrozenInstanceError):
        parameters.overlap_ratio = 0.5


def test_every_ending_is_one_kind_and_says_so():
    kinds = {
        ending: (ending.converged, ending.failed, ending.value.split(":")[0])
        for ending in Termination
    }
    assert kinds == {
        Termination.CONVERGED_POSE: (True, False, "converged"),
        Termination.CONVERGED_COST: (True, False, "converged"),
        Termination.BUDGET_SPENT: (False, False, "not converged"),
        Termination.TOO_FEW_CORRESPONDENCES: (False, True, "failed"),
        Termination.DEGENERATE: (False, True, "failed"),
    }


def correspondences(distances, kept):
    kept = np.array(kept, dtype=bool)
    d = np.array(distances, dtype=float)
    return Correspondences(
        rows=point_rows(homogeneous(np.zeros((len(d), 2))), np.stack([d, 0 * d])),
        center=np.zeros((2, 1)),
        target_points=np.column_stack([d, 0 * d]),
        gate=10.0,
        overlap_ratio=1.0,
        huber_delta=math.inf,
        target_index=np.zeros(len(d), dtype=np.intp),
        distances=d,
        kept=kept,
        weights=kept.astype(float),
    )


def test_numbers_count_the_kept_pairs_alone():
    pairs = correspondences([3.0, 4.0, 100.0, 50.0], [1, 1, 0, 0])
    assert pairs.inlier_count == 2
    assert pairs.fitness == 0.5
    assert pairs.inlier_rmse == math.sqrt((9.0 + 16.0) / 2.0)
    assert pairs.cost == (9.0 + 16.0 + 2 * 10.0**2) / 4  # all four, the far ones at the gate


def test_nothing_kept_is_no_number_rather_than_a_perfect_one():
    pairs = correspondences([0.0, 0.0], [0, 0])
    assert (pairs.inlier_count, pairs.fitness) == (0, 0.0)
    assert math.isnan(pairs.inlier_rmse)
