"""What cannot be meant is refused, with the value that was received."""

import math

import numpy as np
import pytest

from labkit import LabkitError
from labkit.evaluation import ate, compare, loop_closure, rpe

NAN, POSE, POSES = math.nan, np.zeros((1, 3)), np.zeros((5, 3))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: loop_closure(POSE, [1, 2]), r"`closing` must have shape \(3,\), got \(2,\)"),
        (lambda: ate(POSE, POSE, True), '`align` must be "rigid", "origin" or None, got True'),
        (lambda: compare({}, POSES, NAN), r"`stretch` must be in \(0, 1e\+09\] m, got nan"),
        (lambda: rpe(POSES, POSES, 0), "`delta` must be a whole number of at least 1, got 0"),
        (lambda: rpe(POSES, POSES, 1.5), "`delta` must be a whole number .* got 1.5"),
        (lambda: rpe(POSES, POSES, 0.0, "metres"), r"`delta` must be in \(0, 1e\+09\] m, got 0.0"),
        (lambda: rpe(POSES, POSES, unit="feet"), "`unit` must be .*\"metres\", got 'feet'"),
    ],
)
def test_what_cannot_be_meant(call, message):
    with pytest.raises(LabkitError, match=message):
        call()
