"""Clocks of whole seconds that sweeps or wheels share."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.logs import read_log
from labkit.logs.clocks import spread_whole_seconds


@given(rate=st.integers(2, 40), begin=st.floats(0.0, 1.0), seconds=st.floats(2.5, 9.0))
def test_whole_seconds_are_spread_to_within_two_steps_of_the_time(rate, begin, seconds):
    """The law: whatever the rate, wherever in a second a recording begins and ends."""
    times = 100.0 + begin + np.arange(round(rate * seconds)) / rate

    spread = spread_whole_seconds(np.floor(times))

    assert (np.floor(spread) == np.floor(times)).all()
    assert (np.diff(spread) > 0.0).all()
    np.testing.assert_allclose(spread, times, atol=2.0 / rate)


@pytest.mark.parametrize(
    "stamps",
    [
        [10.0, 11.0, 12.0],  # a second each
        [10.0, 10.0, 10.0, 11.0, 12.0, 13.0],  # a clock that stood once
        [10.5, 10.5, 11.5, 11.5],  # no whole seconds
        [10.0, 10.0, 10.0],  # nothing tells how long they took
        [np.nan, np.nan],
    ],
)
def test_other_clocks_are_left_alone(stamps):
    assert spread_whole_seconds(np.array(stamps)) is None


@pytest.mark.parametrize("clock_of_wheels", [np.floor, np.asarray])
def test_scans_in_whole_seconds_have_their_wheels(save, clock_of_wheels):
    times = 100.0 + 0.1 * np.arange(35)
    rows = "".join(f"{int(t)},2,3,4,5,6\n" for t in times)
    scans = save(f"time,r0,r1,r2,r3,r4\n{rows}", "scans.csv")
    poses = "".join(f"{clock_of_wheels(t)},{t - 100.0},0,0\n" for t in times)
    wheels = save(f"stamp,x,y,theta\n{poses}", "wheels.csv")

    log = read_log(scans, angles=(-1.0, 1.0), odometry=wheels)

    np.testing.assert_allclose(np.diff(log.odometry[:, 0]), 0.1, atol=1e-9)
    assert any("the scans counts whole seconds" in remark for remark in log.remarks)
