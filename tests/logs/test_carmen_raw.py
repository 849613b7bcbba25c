"""Raw CARMEN logs: scans and wheels in lines of their own."""

import numpy as np

from labkit.logs import read_log


def test_scans_take_their_poses_from_the_wheels_around_them(save):
    text = ""
    for k in range(6):
        text += f"ODOM {0.2 * k} 0 {0.1 * k} 0 0 0 {10.0 + k} host 1\n"
        text += f"RAWLASER1 0 -0.5 1.0 0.25 30 0.01 0 5 1 2 3 {k + 1} 81 0 {10.5 + k} host 1\n"

    log = read_log(save(text), laser_offset=(0.5, 0.0, 0.0), strict=True)

    assert (len(log), log.format) == (6, "carmen_raw")
    np.testing.assert_allclose(log.scans[2].angles, [-0.5, -0.25, 0.0, 0.25, 0.5])
    assert log.scans[2].beams.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(log.odometry[:5, 2], 0.05 + 0.1 * np.arange(5))
    np.testing.assert_allclose(log.odometry[0, :2], [0.1 + 0.5 * np.cos(0.05), 0.5 * np.sin(0.05)])


def test_damage_is_named_and_costs_its_line(save):
    line = "RAWLASER1 0 -0.5 1.0 0.25 30 0.01 0 3 1 2 3 0 {} host 1\n"
    log = read_log(save("".join(line.format(k) for k in (1, "mud", 3))))
    assert (len(log), [skipped.line for skipped in log.skipped]) == (2, [2])
