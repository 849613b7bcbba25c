"""Codes for "no return": told from walls that happen to stand at the top of the range."""

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.simulation import Lidar, room, scan_along
from labkit.support.errors import InvalidParameterError, InvalidPointsError

STEPS = np.arange(12)
PATH = np.column_stack([0.1 * STEPS - 0.6, 0.03 * STEPS, 0.05 * STEPS])


def sweeps(longest, codes=(), *, share=0.1, digits=3, noise=0.01, path=PATH):
    """Ranges of a drive through a room, scaled until its farthest wall stands at `longest`."""
    lidar = Lidar(beam_count=180, field_of_view=np.pi, noise_std=noise, range_max=100.0)
    ranges = np.array([scan.ranges for scan in scan_along(room(), path, lidar, rng=4)])
    ranges *= longest / ranges.max()
    rng = np.random.default_rng(1)
    if len(codes):
        missed = rng.random(ranges.shape) < share
        ranges[missed] = rng.choice(codes, np.count_nonzero(missed))
    return ranges.round(digits)


def saved(save, line, rows, **options):
    return save("".join(line(row, **options) for row in rows.tolist()))


CODES = [(8.183, 8.187, 8.191), (32.77,), (50.9, 51.07, 51.16), (81.83, 81.91)]


@pytest.mark.parametrize("codes", CODES)
@pytest.mark.parametrize("share", [0.02, 0.4])
def test_a_known_code_at_the_top_makes_no_point(save, flaser, codes, share):
    rows = sweeps(0.97 * min(codes), codes, share=share)
    log = read_log(saved(save, flaser, rows))
    for scan, row in zip(log.scans, rows, strict=True):
        assert scan.beams.tolist() == np.flatnonzero(row < 0.975 * min(codes)).tolist()
        assert (scan.ranges == row).all()
    remark = log.remarks[0]
    count = np.count_nonzero(rows > 0.975 * min(codes))
    assert remark.startswith(f"{count} of {rows.size} ranges (")
    assert f"{max(codes):g} m" in remark
    assert len(remark) < 200


@pytest.mark.parametrize("longest", [8.187, 30.0, 51.0])
@pytest.mark.parametrize(("digits", "noise"), [(2, 0.01), (3, 0.0)])
@pytest.mark.parametrize("stands", [False, True])
def test_a_wall_at_the_top_is_a_wall(save, flaser, longest, digits, noise, stands):
    path = PATH[[3] * 30] if stands else PATH
    rows = sweeps(longest, digits=digits, noise=noise, path=path)
    log = read_log(saved(save, flaser, rows))
    assert all(len(scan) == 180 for scan in log.scans)
    assert not any("no return" in remark for remark in log.remarks)


def test_a_scanner_that_sees_farther_has_no_code_there(save, flaser):
    """Freiburg's logs reach 80 m: what they see at 50 to 52 m and at 8.19 m are walls."""
    rows = sweeps(75.0, (81.91,))
    rows[::2, :3] = 8.191
    log = read_log(saved(save, flaser, rows))
    assert all(
        len(scan) == np.count_nonzero(row < 80.0) for scan, row in zip(log.scans, rows, strict=True)
    )
    assert "read 81.91 m: codes" in log.remarks[0]


@pytest.mark.parametrize(
    ("declared", "codes"),
    [(8.19, (8.183, 8.191)), (40.0, (32.763, 32.767)), (81.92, (81.83, 81.91))],
)
def test_a_declared_maximum_above_the_code_keeps_none(save, robotlaser, declared, codes):
    rows = sweeps(0.9 * codes[0], codes)
    lines = (
        robotlaser(row, maximum=declared, stamp=k + 1.0) for k, row in enumerate(rows.tolist())
    )
    log = read_log(save("".join(lines)))
    for scan, row in zip(log.scans, rows, strict=True):
        assert len(scan) == np.count_nonzero(row < 0.95 * codes[0])


def test_the_caller_has_the_last_word(save, flaser):
    rows = sweeps(7.0, (8.191,))
    path = saved(save, flaser, rows)
    assert all(len(scan) == 180 for scan in read_log(path, no_return=()).scans)
    named = read_log(path, no_return=[rows[0, 5]])
    assert 5 not in named.scans[0].beams
    assert all(8.191 in scan.ranges[scan.beams] for scan in named.scans)
    assert all(len(scan) == 180 for scan in read_log(path, range_max=9.0).scans)
    with pytest.raises(InvalidParameterError, match=r"`no_return` must be positive .* got -1"):
        read_log(path, no_return=-1.0)
    with pytest.raises(InvalidPointsError, match="`no_return` must hold numbers, got 'all'"):
        read_log(path, no_return="all")


def test_an_unknown_code_is_told_and_is_the_callers_to_name(save, flaser):
    rows = sweeps(9.0, (10.0,))
    path = saved(save, flaser, rows)
    told = (
        f"{np.count_nonzero(rows == 10.0)} of {rows.size} ranges read 10 m, the longest of all; if"
    )
    assert read_log(path).remarks[0].startswith(told)
    for scan, row in zip(read_log(path, no_return=10.0).scans, rows, strict=True):
        assert scan.beams.tolist() == np.flatnonzero(row < 10.0).tolist()


@pytest.mark.parametrize("line", ["flaser", "robotlaser"])
def test_millimetres_are_suspected_by_name(save, request, line):
    rows = 1000.0 * sweeps(9.0)
    write = request.getfixturevalue(line)
    options = {"maximum": 81920.0} if line == "robotlaser" else {}
    log = read_log(saved(save, write, rows, **options))
    assert "are they millimetres? labkit reads metres" in log.remarks[0]
