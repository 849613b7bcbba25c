"""Logs of Player's driver writelog."""

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.support.errors import LogError

HEADER = "## Player version 2.1.1 \n## File version 0.3.0 \n## Format: \n"
LASER = (
    "{t:014.3f} 16777343 6665 laser {i:02d} 001 001 0001 -0.5000 +0.5000 +0.25000000 +08.0 0005 "
)


def player_log(*, scanners=1):
    """Ten sweeps a scanner, one each 0.1 s, while the robot drives 1 m/s."""
    text = HEADER + "0000000009.990 16777343 6665 laser 00 004 001 +0.200 0.000 0.000 0.150 0.150\n"
    for k in range(10):
        t = 10.0 + 0.1 * k
        text += (
            f"{t - 0.05:014.3f} 16777343 6665 position2d 00 001 001 {0.1 * k:+07.3f} 0 0 1 0 0 0\n"
        )
        for i in range(scanners):
            text += LASER.format(t=t, i=i) + " ".join(f"{r}.000  0" for r in (1, 2, 3, 8, k + 1))
            text += " \n"
    return text


def test_scans_take_their_poses_from_the_wheels_around_them(save):
    log = read_log(save(player_log()), strict=True)

    assert (len(log), log.format) == (10, "player")
    np.testing.assert_allclose(log.scans[2].angles, [-0.5, -0.25, 0.0, 0.25, 0.5])
    assert log.scans[2].beams.tolist() == [0, 1, 2, 4]  # 8 m is the declared maximum
    np.testing.assert_allclose(log.odometry[:9, 0], 0.25 + 0.1 * np.arange(9))
    assert log.laser_offset.tolist() == [0.2, 0.0, 0.0]


def test_of_two_scanners_one_is_read_and_the_other_told(save):
    log = read_log(save(player_log(scanners=2)))
    other = read_log(save(player_log(scanners=2)), frame="laser:01")

    assert (len(log), len(other)) == (10, 10)
    assert any("10 scans of the frame 'laser:01' are left out" in note for note in log.remarks)


def test_damage_is_named_and_costs_its_line(save):
    log = read_log(save(player_log().replace("0005 1.000", "0006 1.000", 1)))
    assert [(damage.line, len(log)) for damage in log.skipped] == [(6, 9)]
    assert log.skipped[0].reason == "23 fields, expected 25 for laser with 6 beams"


def test_a_log_of_ranger_lines_says_what_it_holds(save):
    text = player_log().replace(" laser ", " ranger ")
    with pytest.raises(
        LogError, match=r"a player log without .*; it holds ranger \(11 lines\), pos"
    ):
        read_log(save(text))
