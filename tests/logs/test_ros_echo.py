"""What `ros2 topic echo --csv` prints of scans."""

import numpy as np
import pytest

from labkit.logs import read_log

RANGES = np.random.default_rng(4).uniform(1.0, 4.0, (3, 20)).round(3)


@pytest.mark.parametrize("intensities", [True, False])
@pytest.mark.parametrize("step", [0.1, 0.0])
def test_messages_are_read_by_the_order_of_their_fields(save, intensities, step):
    last = -1.0 + 0.1 * 19
    head = f"{-1.0},{last},{step},0.001,0.1,0.1,30.0"
    rows = [
        f"1700000000,{k}00000000,laser,{head},{','.join(map(str, row))}"
        + (20 * ",47.0" if intensities and step else "")
        for k, row in enumerate(RANGES)
    ]

    log = read_log(save("\n".join(rows) + "\n"), strict=True)

    np.testing.assert_array_equal([scan.ranges for scan in log.scans], RANGES)
    np.testing.assert_allclose(log.scans[0].angles, -1.0 + 0.1 * np.arange(20))
    np.testing.assert_allclose(log.stamps, 1.7e9 + 0.1 * np.arange(3))
    assert (log.format, log.scans[0].time_increment) == ("ros_echo", 0.001)


def test_a_printed_message_that_is_cut_is_damage(save):
    row = f"17,0,laser,-1.0,1.0,0.1,0,0,0.1,30.0,{','.join(map(str, RANGES[0]))}\n"
    log = read_log(save(row + row[:20] + "\n" + row.replace("17,", "18,")))
    assert (len(log), [line.line for line in log.skipped]) == (2, [2])
