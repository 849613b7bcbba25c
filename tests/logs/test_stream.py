"""A log as a stream: the same scans as in memory, at the memory of one."""

import tracemalloc

import numpy as np
import pytest

from labkit.logs import read_log, stream_log
from labkit.logs.killian import KILLIAN

FOUR = [1.0, 2.0, 3.0, 81.91]


def graph(robotlaser, count=30):
    return "".join(
        f"VERTEX_SE2 {k} {0.5 * k} 0 0\n"
        + robotlaser([1.0 + k, 2.0, 81.83, 81.91], (0.4 * k, 0.1, 0.0), maximum=100.0)
        for k in range(count)
    )


LOGS = {
    "carmen": lambda flaser, robotlaser: "".join(
        flaser([*FOUR, 1.0 + k], (0.5 * k, 0.0, 0.1), ipc=0.0, logger=0.0) for k in range(30)
    ),
    "g2o": lambda flaser, robotlaser: graph(robotlaser),
    "points": lambda flaser, robotlaser: "7,1,2\n3,0,0\n7,-3.5,0.004\n9,1,1\n3,5,5\n",
}


@pytest.mark.parametrize("kind", LOGS)
def test_a_stream_holds_what_the_log_holds(save, flaser, robotlaser, kind):
    text = LOGS[kind](flaser, robotlaser)
    lines = text.splitlines(keepends=True)
    damaged = "1,mud\n" if kind == "points" else "ROBOTLASER1 4 mud\n"
    path = save("".join([*lines[:4], damaged, *lines[4:]]))
    log, stream = read_log(path), stream_log(path)
    assert (len(stream), stream.name, stream.format) == (len(log), log.name, kind)
    assert (stream.skipped, stream.remarks) == (log.skipped, log.remarks)
    for poses, expected in ((stream.odometry, log.odometry), (stream.reference, log.reference)):
        np.testing.assert_array_equal(poses, expected)
    np.testing.assert_array_equal(stream.stamps, log.stamps)
    for _ in range(2):  # a stream begins anew
        scans = list(stream.scans)
        assert len(scans) == len(log)
        for scan, expected in zip(scans, log.scans, strict=True):
            assert scan.points.tolist() == expected.points.tolist()
            assert (scan.stamp == expected.stamp) | np.isnan(scan.stamp) & np.isnan(expected.stamp)
    assert [len(scan) for scan in stream.load().scans] == [len(scan) for scan in log.scans]


def test_memory_does_not_grow_with_the_length(save, flaser):
    peaks = []
    for count in (100, 1500):
        text = "".join(flaser(3 * list(range(1, 61)), (0.1 * k, 0.0, 0.0)) for k in range(count))
        path = save(text)
        tracemalloc.start()
        try:
            for scan in stream_log(path).scans:
                assert len(scan) == 180
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert peaks[1] - peaks[0] < 2e6  # the scans alone would take 8 MB


def test_scans_of_a_table_come_as_soon_as_they_are_whole(save):
    path = save("".join(f"{k},{k},{n}\n" for k in range(500) for n in range(40)))
    stream = stream_log(path)
    tracemalloc.start()
    try:
        assert [scan.points[0, 0] for scan in stream.scans] == list(range(500))
        assert tracemalloc.get_traced_memory()[1] < 3e6
    finally:
        tracemalloc.stop()


def test_the_built_in_run_as_a_stream(killian):
    stream = stream_log(KILLIAN)
    assert len(stream) == len(killian)
    for scan, expected in zip(stream.scans, killian.scans, strict=True):
        assert scan.stamp == expected.stamp
        assert len(scan) == len(expected)
