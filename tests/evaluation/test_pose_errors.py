"""Summaries: numpy's statistics, and NaN where there is nothing."""

import math
from dataclasses import fields

import numpy as np
import pytest

from labkit.errors import InvalidPointsError
from labkit.evaluation import ErrorSummary


def test_known_numbers():
    summary = ErrorSummary.of(np.arange(101.0))
    assert (summary.mean, summary.median, summary.p95, summary.max) == (50.0, 50.0, 95.0, 100.0)
    assert summary.std == pytest.approx(math.sqrt((101**2 - 1) / 12))
    assert summary.rmse == pytest.approx(math.hypot(summary.mean, summary.std))


def test_nothing_has_no_number():
    summary = ErrorSummary.of([])
    assert summary.count == 0
    others = [getattr(summary, field.name) for field in fields(summary) if field.name != "count"]
    assert len(others) == 6
    assert all(math.isnan(value) for value in others)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ([1.0, math.nan], r"`errors` must be finite and of shape \(N,\), got nan"),
        ([[1.0]], r"`errors` must be finite and of shape \(N,\), got shape \(1, 1\)"),
    ],
)
def test_errors_that_are_none(errors, message):
    with pytest.raises(InvalidPointsError, match=message):
        ErrorSummary.of(errors)
