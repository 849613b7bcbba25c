"""Parameters that refuse nonsense."""

import math

import numpy as np
import pytest

from labkit import IcpParameters
from labkit.support.errors import InvalidParameterError

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("max_correspondence_distance", 0.0, "in (0, inf] m"),
        ("max_correspondence_distance", NAN, "in (0, inf] m"),
        ("overlap_ratio", 0.0, "in (0, 1]"),
        ("overlap_ratio", 1.3, "in (0, 1]"),
        ("overlap_ratio", True, "in (0, 1]"),
        ("huber_delta", 0.0, "in (0, inf] m"),
        ("huber_delta", "0.2", "in (0, inf] m"),
        ("translation_tolerance", -1e-9, "in [0, inf] m"),
        ("rotation_tolerance", -1e-9, "in [0, inf] rad"),
        ("cost_tolerance", -1e-9, "in [0, inf] m²"),
        ("step_fraction", 0.0, "in (0, 1]"),
        ("step_fraction", np.array([0.5, 0.6]), "in (0, 1]"),
        *(("max_iterations", k, "a whole number of at least 1") for k in (0, 60.0, "60", True)),
        ("metric", "plane", "one of point_to_point, point_to_line"),
        ("metric", ["point_to_line"], "one of point_to_point, point_to_line"),
        ("approach", 1, "True or False"),
    ],
)
def test_parameters_of_icp(name, value, expected):
    with pytest.raises(InvalidParameterError) as caught:
        IcpParameters(**{name: value})
    assert str(caught.value) == f"`{name}` must be {expected}, got {value!r}"


def test_everything_can_be_turned_off():
    off = dict.fromkeys(("translation_tolerance", "rotation_tolerance", "cost_tolerance"), 0.0)
    wide = dict.fromkeys(("max_correspondence_distance", "huber_delta"), INF)
    IcpParameters(**off, **wide, overlap_ratio=1.0, max_iterations=np.int64(1))
