"""What cannot be meant is refused, with the value that was received."""

import math

import numpy as np
import pytest

from labkit.evaluation import (
    ErrorSummary,
    associate,
    ate,
    loop_closure,
    rpe,
)
from labkit.support.errors import InvalidParameterError, InvalidPointsError

NAN, POSE, POSES = math.nan, np.zeros((1, 3)), np.zeros((5, 3))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: associate([0.0], [[0.0]], 1.0), r"`stamps_b` must have shape \(K,\), got"),
        (lambda: associate([0.0], [0.0, NAN], 1.0), "`stamps_b` must be .* nan at index 1"),
        (lambda: loop_closure(POSE, [1, 2]), "`closing` must be 3 finite numbers"),
        (lambda: ErrorSummary.of([1.0, NAN]), r"`errors` must be .* of shape \(N,\), got nan"),
        (lambda: ErrorSummary.of([[1.0]]), r"`errors` must be .* got shape \(1, 1\)"),
    ],
)
def test_trajectories_that_cannot_be_meant(call, message):
    with pytest.raises(InvalidPointsError, match=message):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ate(POSE, POSE, "umeyama"), "`align` must be .* or None, got 'umeyama'"),
        (lambda: ate(POSE, POSE, True), '`align` must be "rigid", "origin" or None, got True'),
        (lambda: rpe(POSES, POSES, 0), "`delta` must be a whole number of at least 1 step, got 0"),
        (lambda: rpe(POSES, POSES, 1.5), "`delta` must be a whole number .* step, got 1.5"),
        (lambda: rpe(POSES, POSES, 0.0, "metres"), r"`delta` must be in \(0, 1e\+09\] m, got 0.0"),
        (lambda: rpe(POSES, POSES, unit="feet"), "`unit` must be .*\"metres\", got 'feet'"),
        (lambda: associate([0.0], [0.0], NAN), "`tolerance` must be in .* s, got nan"),
    ],
)
def test_parameters_that_cannot_be_meant(call, message):
    with pytest.raises(InvalidParameterError, match=message):
        call()
