"""Parameters that refuse nonsense."""

import math

import numpy as np
import pytest

from labkit import IcpParameters
from labkit.errors import InvalidParameterError

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("name", "value", "interval"),
    [
        ("max_correspondence_distance", 0.0, "(0, inf] m"),
        ("max_correspondence_distance", NAN, "(0, inf] m"),
        ("overlap_ratio", 0.0, "(0, 1]"),
        ("overlap_ratio", 1.3, "(0, 1]"),
        ("overlap_ratio", True, "(0, 1]"),
        ("huber_delta", 0.0, "(0, inf] m"),
        ("huber_delta", "0.2", "(0, inf] m"),
        ("translation_tolerance", -1e-9, "[0, inf] m"),
        ("rotation_tolerance", -1e-9, "[0, inf] rad"),
        ("cost_tolerance", -1e-9, "[0, inf] m²"),
        ("step_fraction", 0.0, "(0, 1]"),
        ("step_fraction", np.array([0.5, 0.6]), "(0, 1]"),
    ],
)
def test_a_parameter_outside_its_range(name, value, interval):
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(**{name: value})
    assert str(caught.value) == f"`{name}` must be in {interval}, got {value!r}"


@pytest.mark.parametrize("budget", [0, 60.0, "60", True])
def test_a_budget_that_is_no_count(budget):
    message = f"`max_iterations` must be a whole number of at least 1, got {budget!r}"
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(max_iterations=budget)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("metric", "plane", "one of point_to_point, point_to_line"),
        ("metric", ["point_to_line"], "one of point_to_point, point_to_line"),
        ("approach", 1, "True or False"),
    ],
)
def test_an_unknown_choice(name, value, expected):
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(**{name: value})
    assert str(caught.value) == f"`{name}` must be {expected}, got {value!r}"


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
