"""JSON, an object a line."""

import json

import numpy as np
import pytest

from labkit.logs import read_log

RANGES = np.random.default_rng(5).uniform(1.0, 4.0, (4, 12)).round(3)


def message(k, **others):
    """A LaserScan as rosbridge writes it."""
    stamp = {"secs": 1700000000, "nsecs": 100000000 * k}
    header = {"seq": k, "stamp": stamp, "frame_id": "laser"}
    geometry = {"angle_min": -1.1, "angle_max": 1.1, "angle_increment": 0.2}
    return {"header": header, **geometry, "range_max": 30.0, "ranges": RANGES[k].tolist(), **others}


@pytest.mark.parametrize("wrapped", [True, False])
def test_messages_are_read_by_their_names_at_any_depth(save, wrapped):
    rows = [{"op": "publish", "msg": message(k)} if wrapped else message(k) for k in range(4)]

    log = read_log(save("".join(json.dumps(row) + "\n" for row in rows)))

    np.testing.assert_array_equal([scan.ranges for scan in log.scans], RANGES)
    np.testing.assert_allclose(log.scans[0].angles, np.linspace(-1.1, 1.1, 12))
    np.testing.assert_allclose(log.stamps, 1.7e9 + 0.1 * np.arange(4))
    assert [remark.split(":")[0] for remark in log.remarks] == ["not read"] * wrapped


def test_null_is_no_return_and_damaged_lines_are_named(save):
    rows = [json.dumps(message(k)) for k in range(4)]
    rows[1] = rows[1].replace(str(RANGES[1, 3]), "null")
    rows[2] = rows[2][:40]

    log = read_log(save("\n".join(rows)))

    assert [line.line for line in log.skipped] == [3]
    assert log.skipped[0].reason.startswith("no JSON: ")
    assert 3 not in log.scans[1].beams
    assert len(log) == 3
