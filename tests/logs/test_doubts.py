"""What is no return, by codes and by declaration; clocks and units."""

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.simulation import Lidar, room, scan_along
from labkit.support.errors import InvalidParameterError, InvalidPointsError

STEPS = np.arange(12)
PATH = np.column_stack([0.1 * STEPS - 0.6, 0.03 * STEPS, 0.05 * STEPS])
LIDAR = Lidar(beam_count=180, field_of_view=np.pi, range_max=100.0)


def sweeps(longest, codes=(), share=0.1):
    """Ranges of a drive through a room, scaled until its farthest wall stands at `longest`."""
    ranges = np.array([scan.ranges for scan in scan_along(room(), PATH, LIDAR, rng=4)])
    ranges *= longest / ranges.max()
    rng = np.random.default_rng(1)
    if len(codes):
        missed = rng.random(ranges.shape) < share
        ranges[missed] = rng.choice(codes, np.count_nonzero(missed))
    return ranges.round(3)


def saved(save, line, rows, **options):
    """A log of these ranges, a scan a second."""
    clock = "stamp" if "maximum" in options else "ipc"
    lines = (line(row, **{clock: k + 1.0}, **options) for k, row in enumerate(rows.tolist()))
    return save("".join(lines))


CODES = [(8.183, 8.187, 8.191), (32.77,), (50.9, 51.07, 51.16), (81.83, 81.91)]


@pytest.mark.parametrize("codes", CODES)
@pytest.mark.parametrize("share", [0.02, 0.4])
@pytest.mark.parametrize("declared", [None, 1.001, 1.2])  # times the longest code
def test_a_known_code_at_the_top_makes_no_point(save, flaser, robotlaser, codes, share, declared):
    """The law: whether the log declares no maximum, or one above the code."""
    rows = sweeps(0.97 * min(codes), codes, share=share)
    options = {} if declared is None else {"maximum": declared * max(codes)}
    log = read_log(saved(save, robotlaser if options else flaser, rows, **options))
    for scan, row in zip(log.scans, rows, strict=True):
        assert scan.beams.tolist() == np.flatnonzero(row < 0.975 * min(codes)).tolist()
        assert (scan.ranges == row).all()
    if options or max(codes) < 81.8:  # where every FLASER ends
        count = np.count_nonzero(rows > 0.975 * min(codes))
        assert log.remarks[0].startswith(f"{count} of {rows.size} ranges (")
        assert f"{max(codes):g} m: codes for no return" in log.remarks[0]


def test_a_scanner_that_sees_farther_has_no_code_there(save, flaser):
    """Freiburg's logs reach 80 m: what they see at 50 to 52 m and at 8.19 m are walls."""
    rows = sweeps(75.0, (81.91,))
    rows[::2, :3] = 8.191
    log = read_log(saved(save, flaser, rows))
    assert [len(scan) for scan in log.scans] == np.count_nonzero(rows < 80.0, axis=1).tolist()


def test_the_caller_has_the_last_word(save, flaser):
    rows = sweeps(7.0, (8.191,))
    path = saved(save, flaser, rows)
    assert all(len(scan) == 180 for scan in read_log(path, no_return=()).scans)
    named = read_log(path, no_return=[rows[0, 5]])
    assert 5 not in named.scans[0].beams
    assert all(8.191 in scan.ranges[scan.beams] for scan in named.scans)
    with pytest.raises(InvalidParameterError, match=r"`no_return` must be positive .* got -1"):
        read_log(path, no_return=-1.0)
    with pytest.raises(InvalidPointsError, match="`no_return` must hold numbers, got 'all'"):
        read_log(path, no_return="all")


def test_an_unknown_code_is_told_and_is_the_callers_to_name(save, flaser):
    rows = sweeps(9.0, (10.0,))
    path = saved(save, flaser, rows)
    told = f"{np.count_nonzero(rows == 10.0)} of {rows.size} ranges read 10 m, the longest of all"
    assert read_log(path).remarks[0].startswith(told)
    for scan, row in zip(read_log(path, no_return=10.0).scans, rows, strict=True):
        assert scan.beams.tolist() == np.flatnonzero(row < 10.0).tolist()


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_code_that_scatters_is_told_with_the_way_out(save, flaser, share):
    rows = sweeps(3.0)
    rng = np.random.default_rng(2)
    missed = rng.random(rows.shape) < share
    rows[missed] = rng.uniform(3.46, 3.5, np.count_nonzero(missed)).round(3)
    path = saved(save, flaser, rows)

    (remark,) = read_log(path).remarks
    longest = float(remark.partition("`--range-max ")[2].rstrip("`)"))
    log = read_log(path, range_max=longest)

    assert remark.startswith(f"{np.count_nonzero(missed)} of {rows.size} ranges read 3.4")
    for scan, row in zip(log.scans, ~missed, strict=True):
        assert scan.beams.tolist() == np.flatnonzero(row).tolist()


@pytest.mark.parametrize("code", [0, "nan", 90.0, 3.4028235e38])
def test_what_is_no_range_makes_no_point(save, flaser, code):
    scan = read_log(save(flaser([1.0, code, 40.0, 60.0]))).scans[0]
    assert scan.beams.tolist() == [0, 2, 3]
    assert len(scan.ranges) == 4


def test_millimetres_are_suspected_by_name(save, flaser, robotlaser):
    rows = 1000.0 * sweeps(9.0)
    for path in (saved(save, flaser, rows), saved(save, robotlaser, rows, maximum=81920.0)):
        assert "are they millimetres or centimetres? `range_unit` (" in read_log(path).remarks[0]


STUTTER = [10.0, 11.0, 11.0, 10.5, 12.0, 11.5]


@pytest.mark.parametrize(
    ("clocks", "stamps"),
    [
        ([(0.0, 3.5)], [3.5]),  # the logger's stands in
        ([(0.0, 0.0), (0.0, 0.0)], [np.nan, np.nan]),
        ([(0.0, 0.0), (0.1, 0.0)], [0.0, 0.1]),
        ([(t, 0.0) for t in STUTTER], STUTTER),
    ],
)
def test_clocks(save, flaser, clocks, stamps):
    log = read_log(save("".join(flaser([1.0, 2.0], ipc=a, logger=b) for a, b in clocks)))
    np.testing.assert_array_equal(log.stamps, stamps)
    told = "the clock of the scans stands still or runs backwards 3 times, first at line 3: 11 s af"
    assert [remark.startswith(told) for remark in log.remarks] == [True] * (stamps == STUTTER)


def ranges_table(save, rows, **options):
    titles = ",".join(f"r{k}" for k in range(rows.shape[1]))
    text = "".join(",".join(f"{r:.3f}" for r in row) + "\n" for row in rows)
    return read_log(save(f"{titles}\n{text}"), angles=(-1.5, 1.5), **options)


@pytest.mark.parametrize("share", [0.1, 0.5])
def test_near_beams_that_never_change_while_others_do_are_told_with_the_way_out(save, share):
    """The law: both options that the remark names leave them out, and end it."""
    rows = sweeps(9.0)
    count = round(share * rows.shape[1])
    rows[:, 10 : 10 + count] = 0.25 + np.random.default_rng(2).normal(0, 2e-3, (12, count))

    remarks = ranges_table(save, rows).remarks

    assert f"{count} of 180 beams read the same 0.2" in remarks[0]
    assert f"`--blind-beams 10-{9 + count}`" in remarks[0]
    way_out = float(remarks[0].partition("--range-min ")[2].partition("`")[0])
    for options in ({"blind_beams": np.arange(10, 10 + count)}, {"range_min": way_out}):
        log = ranges_table(save, rows, **options)
        assert log.remarks == ()
        assert not {*range(10, 10 + count)} & {*log.scans[3].beams}


@pytest.mark.parametrize("noise", [0.001, 0.004])
def test_a_robot_at_rest_near_a_wall_has_no_blind_beams(save, noise):
    rows = np.tile(sweeps(9.0)[:1], (12, 1))
    rows[:, :60] = 0.4
    rows = rows + np.random.default_rng(1).normal(0.0, noise, rows.shape)
    assert ranges_table(save, rows).remarks == ()


@pytest.mark.parametrize("codes", [(0.12,), (0.001, 0.011, 0.019)])
def test_a_code_at_the_lower_end_is_told_with_the_way_out(save, codes):
    rows = sweeps(9.0, codes, share=0.3)

    remarks = ranges_table(save, rows).remarks

    count = np.count_nonzero(np.isin(rows, codes))
    assert remarks[0].startswith(f"{count} of {rows.size} ranges read ")
    way_out = float(remarks[0].partition("--range-min ")[2].partition("`")[0])
    assert max(codes) < way_out < 0.2
    assert ranges_table(save, rows, range_min=way_out).remarks == ()
