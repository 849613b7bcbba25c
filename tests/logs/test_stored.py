"""Scans of a log: one object as long as somebody holds it, and little memory."""

import gc
import pickle
import tracemalloc
import weakref

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.logs.stored import LAST_SCANS, StoredScan, pack

COUNT, BEAMS = 3 * LAST_SCANS, 360


@pytest.fixture
def log(save):
    """A table of ranges, read."""
    ranges = np.random.default_rng(4).uniform(1.0, 4.0, (COUNT, BEAMS))
    titles = ",".join(f"r{b}" for b in range(BEAMS))
    rows = "\n".join(",".join(map(str, row)) for row in ranges.round(3).tolist())
    return read_log(save(f"{titles}\n{rows}\n", "run.csv"), angles=(-1.0, 1.0))


MILLIMETRES = np.arange(65_536) / 1000.0


@pytest.mark.parametrize(
    ("ranges", "size"),
    [
        (np.array([float(f"{r:.3f}") for r in MILLIMETRES]), 2),  # as a text tells them
        (np.float64(np.float32(MILLIMETRES + 0.0003)), 4),  # as a bag does
        (np.array([0.5, np.nan, np.inf, -np.inf]), 4),
        (np.array([1.2345, np.nan]), 8),
        (np.array([65.536]), 8),
        (np.array([-0.001]), 8),
    ],
)
def test_ranges_are_packed_and_come_back_to_the_last_bit(ranges, size):
    packed = pack(ranges)
    stored = StoredScan(
        packed=packed, angles=np.zeros_like(ranges), stamp=0.0, time_increment=0.0, band=(0.0, 9.0)
    )

    np.testing.assert_array_equal(stored.ranges, ranges)
    assert packed.itemsize == size
    assert not stored.ranges.flags.writeable


def test_a_scan_that_somebody_holds_is_the_same_object(log):
    held = log.scans[3]

    for scan in log.scans:
        assert len(scan) == BEAMS

    assert log.scans[3] is held
    assert log.scans[3 - COUNT] is held
    assert log.scans[2:5][1] is held
    assert log.head(4).scans[-1] is held


def test_the_last_scans_live_on_and_no_others(log):
    scans = [weakref.ref(scan) for scan in log.scans]

    gc.collect()

    alive = [scan() is not None for scan in scans]
    assert alive == [False] * (COUNT - LAST_SCANS) + [True] * LAST_SCANS


def test_a_scan_that_is_asked_for_again_and_again_lives_on(log):
    """Many scans against one: the pattern `icp(log.scans[k], log.scans[0])`."""
    first = weakref.ref(log.scans[0])

    for k in range(1, COUNT):
        assert log.scans[k] is not first()
        assert log.scans[0] is first()


def test_a_log_that_was_gone_through_takes_no_more_memory(log):
    _ = [scan.points.sum() for scan in log.scans[:LAST_SCANS]]
    tracemalloc.start()

    _ = [scan.points.sum() for scan in log.scans]

    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    scan = log.scans[0]
    assert grown < 1.5 * LAST_SCANS * (scan.points.nbytes + scan.ranges.nbytes)


def test_a_log_is_pickled_without_the_scans_that_were_made(log):
    before = pickle.dumps(log)
    held = list(log.scans)

    sent = pickle.dumps(log)

    assert len(sent) == len(before)
    for scan, expected in zip(pickle.loads(sent).scans, held, strict=True):
        np.testing.assert_array_equal(scan.points, expected.points)
        assert not scan.points.flags.writeable
