"""What cannot be meant is refused, with the value that was received."""

import math
from functools import partial

import numpy as np
import pytest

from labkit import LabkitError, wrap
from labkit.evaluation import (
    ErrorSummary,
    PoseErrors,
    ate,
    compare,
    disagreement,
    forward_backward,
    loop_closure,
    rpe,
)

POSE = np.zeros((1, 3))
POSES = np.zeros((5, 3))
TURNS = np.linspace(0.0, 6.0 * math.pi, 60)  # three rounds
ROUNDS = np.column_stack([np.cos(TURNS), np.sin(TURNS), TURNS])
IN_DEGREES = np.column_stack([ROUNDS[:, :2], np.degrees(TURNS)])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (partial(loop_closure, POSE, [1, 2]), r"`closing` must have shape \(3,\), got \(2,\)"),
        (partial(ate, POSE, POSE, True), '`align` must be "rigid", "origin" or None, got True'),
        (partial(ate, POSE, POSE, POSES), '`align` must be "rigid", "origin" or None, got array'),
        (partial(compare, {}, POSES, math.nan), r"`stretch` must be in \(0, 1e\+09\] m, got nan"),
        (partial(rpe, POSES, POSES, 0), "`delta` must be a whole number of at least 1 .* got 0"),
        (partial(rpe, POSES, POSES, 1.5), "`delta` must be a whole number .* got 1.5"),
        (partial(rpe, POSES, POSES, 0.0, "metres"), r"`delta` must be in \(0, 1e\+09\] m, got 0.0"),
        (partial(rpe, POSES, POSES, unit="feet"), "`unit` must be \"steps\" or .*, got 'feet'"),
        (partial(ErrorSummary.of, [1.0, math.nan]), "`errors` must be finite, got nan at index 1"),
        (partial(PoseErrors, [1.0], [1.0, 2.0]), r"`rotation_errors` must have shape \(1,\), got"),
    ],
)
def test_what_cannot_be_meant(call, message):
    with pytest.raises(LabkitError, match=message):
        call()


@pytest.mark.parametrize("arguments", [(IN_DEGREES, ROUNDS), (ROUNDS, IN_DEGREES)])
@pytest.mark.parametrize("error", [ate, rpe])
def test_headings_in_degrees_are_refused(error, arguments):
    with pytest.raises(LabkitError, match=r"must have headings in radians, got .* `np.radians`"):
        error(*arguments)


def test_headings_whose_full_turns_are_counted_anew_are_radians():
    counted = ROUNDS.copy()
    counted[40:, 2] -= 2.0 * math.pi  # beyond 2π before, and a jump back by nearly a full turn

    assert ate(counted, ROUNDS).translation.max < 1e-9


@pytest.mark.parametrize("check", [forward_backward, disagreement])
def test_turns_in_degrees_are_refused(check):
    steps = np.array([[0.5, 0.0, 0.1], [0.5, 0.0, 20.0]])
    with pytest.raises(LabkitError, match=r"by at most 2π .*, got 20 at index 1; .* `np.radians`"):
        check(steps, steps)


def test_headings_that_count_full_turns_are_the_same_poses():
    wrapped = np.column_stack([ROUNDS[:, :2], wrap(TURNS)])
    assert ate(ROUNDS, wrapped).rotation.max < 1e-9
