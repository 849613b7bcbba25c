"""What RPLIDAR's own program prints."""

import numpy as np

from labkit.logs import read_log

BANNER = "Ultra simple LIDAR data grabber for RPLIDAR.\nVersion: 1.12.0\n"


def turn(distance, first=0, missed=()):
    """A clockwise turn of 36 beams."""
    line = "{} theta: {:06.2f} Dist: {:08.2f} Q: 47 \n"
    values = [0.0 if k in missed else distance for k in range(36)]
    return "".join(
        line.format("S " if k == 0 else "  ", 10.0 * k, values[k]) for k in range(first, 36)
    )


def test_turns_are_read_counter_clockwise_in_metres_and_a_cut_one_is_left_out(save):
    text = (
        BANNER + turn(900.0, first=20) + "".join(turn(1000.0 * k, missed=(3,)) for k in (1, 2, 3))
    )

    log = read_log(save(text), strict=True)

    assert (log.format, [len(scan) for scan in log.scans]) == ("rplidar", [35, 35, 35])
    np.testing.assert_allclose(log.scans[1].points[8], [0.0, -2.0], atol=1e-3)  # 90°, clockwise
    assert "the first scan covers 150 degrees" in log.remarks[0]


def test_a_line_that_is_cut_is_damage(save):
    text = turn(1000.0) + turn(1000.0).replace("Dist: 01000.00 Q: 47", "Dist:", 1)
    log = read_log(save(text))
    assert [line.line for line in log.skipped] == [37]
    assert len(log) == 2
