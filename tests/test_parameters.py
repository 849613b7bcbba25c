"""Parameters that refuse nonsense."""

import math

import numpy as np
import pytest

from labkit import IcpParameters
from labkit.support.errors import InvalidParameterError

NAN, INF = math.nan, math.inf


BAD = {  # what each must be, and what it is not
    "max_correspondence_distance": ("in (0, inf] m", [0.0, NAN]),
    "overlap_ratio": ("in (0, 1]", [0.0, 1.3, True]),
    "huber_delta": ("in (0, inf] m", [0.0, "0.2"]),
    "translation_tolerance": ("in [0, inf] m", [-1e-9]),
    "rotation_tolerance": ("in [0, inf] rad", [-1e-9]),
    "cost_tolerance": ("in [0, inf] m²", [-1e-9]),
    "step_fraction": ("in (0, 1]", [0.0, np.array([0.5, 0.6])]),
    "max_iterations": ("a whole number of at least 1", [0, 60.0, "60", True]),
    "metric": ('"point_to_point" or "point_to_line"', ["plane", ["point_to_line"]]),
    "approach": ("of the class bool", [1]),
}


@pytest.mark.parametrize("name", BAD)
def test_parameters_of_icp(name):
    expected, values = BAD[name]
    for value in values:
        with pytest.raises(InvalidParameterError) as caught:
            IcpParameters(**{name: value})
        assert str(caught.value) == f"`{name}` must be {expected}, got {value!r}"


def test_everything_can_be_turned_off():
    off = dict.fromkeys(("translation_tolerance", "rotation_tolerance", "cost_tolerance"), 0.0)
    wide = dict.fromkeys(("max_correspondence_distance", "huber_delta"), INF)
    IcpParameters(**off, **wide, overlap_ratio=1.0, max_iterations=np.int64(1))
