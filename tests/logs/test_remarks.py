"""What is odd about a log but no damage: told by name, never swallowed."""

import pytest

from labkit.errors import LogError
from labkit.logs import read_log, read_points
from labkit.logs.points import read_single

FOUR = [1.0, 2.0, 3.0, 4.0]


def test_a_good_log_has_nothing_odd(save, run):
    assert read_log(save(run)).remarks == ()


def test_a_clock_that_stands_still_or_runs_backwards(save, flaser):
    stamps = [10.0, 11.0, 11.0, 10.5, 12.0, 11.5]
    log = read_log(save("".join(flaser(FOUR, ipc=stamp) for stamp in stamps)))
    assert log.remarks == (
        "the clock of the scans runs backwards 2 times, first at line 4: 10.5 s after 11 s",
        "the clock of the scans stands still 1 times, first at line 3: 11 s after 11 s",
    )


def test_poses_beyond_100_km(save, flaser):
    path = save(flaser(FOUR, ipc=1.0) + flaser(FOUR, (4.5e6, 1.0, 0.0), ipc=2.0))
    assert read_log(path).remarks == (
        "the robot's pose lies beyond 100 km in 1 of 2 lines, the first is 2: (4.5e+06, 1)",
    )


def test_points_beyond_100_km(save):
    log = read_log(save("1,2\n2,3\n3e8,0\n0,-2e5\n0,0\n1,1\n"))
    assert log.remarks == ("2 of 6 points lie beyond 100 km, the first in line 3: (3e+08, 0)",)


def test_points_in_millimetres(save):
    path = save("".join(f"{1000 * k},{-500 * k}\n" for k in range(9)))
    for remarks in (read_log(path).remarks, read_single(path).remarks):
        assert "are they millimetres? labkit reads metres" in remarks[0]
    surveyed = save("".join(f"{4.5e6 + k},{5.4e6 - k}\n" for k in range(9)), "utm.csv")
    assert not any("millimetres" in remark for remark in read_log(surveyed).remarks)


HEADERS = {
    "x,y,z": "{x},{y},0.5",
    ",x,y": "{n},{x},{y}",
    "x,y,intensity": "{x},{y},17",
    "Y,X": "{y},{x}",
    '"time","x","y"': "{n}.25,{x},{y}",
    "intensity x y": "{n} {x} {y}",
}


@pytest.mark.parametrize("header", HEADERS)
def test_a_header_names_its_columns(save, header):
    points = [(1.0, 2.0), (1.5, 2.0), (3.0, -1.0)]
    rows = [HEADERS[header].format(n=n, x=x, y=y) for n, (x, y) in enumerate(points)]
    path = save("\n".join([header, *rows]))
    log = read_log(path, strict=True)
    assert len(log) == 1
    assert read_points(path).points.tolist() == [list(point) for point in points]
    others = header.lower().count(",") + header.count(" ") - 1
    assert len(log.remarks) == (others > 0)
    assert all("columns beside x, y and scan are left out: " in remark for remark in log.remarks)


def test_a_header_may_name_the_scan_anywhere(save):
    log = read_log(save("x,y,intensity,scan\n1,2,99,4\n3,4,98,5\n5,6,97,4\n"))
    assert [scan.points.tolist() for scan in log.scans] == [[[1.0, 2.0], [5.0, 6.0]], [[3.0, 4.0]]]


def test_three_columns_without_a_header_number_their_scans(save):
    rows = "".join(f"{k / 2},{k},100\n" for k in range(20))
    with pytest.raises(LogError, match=r"run\.log: 10 of 20 rows begin with no whole number, so"):
        read_log(save(rows))
    with pytest.raises(LogError, match=r"expected a whole number; a header names other columns"):
        read_log(save("1.25,2.5,7\n1.75,2.25,9\n"))
    numbered = save("1.000e+00,1,2\n1.000e+00,3,4\n2.000e+00,5,6\n")
    assert [len(scan) for scan in read_log(numbered).scans] == [2, 1]


@pytest.mark.parametrize("number", ["1_000", "١٢", "１２", "1_0.5"])
def test_digits_are_ascii_and_not_grouped(save, flaser, number):
    for place in (3, 6, 12):
        fields = flaser(FOUR).split()
        fields[place] = number
        log = read_log(save(flaser(FOUR) + " ".join(fields) + "\n" + flaser(FOUR)))
        assert [skipped.line for skipped in log.skipped] == [2]
        assert repr(number) in log.skipped[0].reason
    table = read_log(save(f"1,2\n{number},3\n"))
    assert table.skipped[0].reason == f"x is {number!r}, expected a finite number"


def test_a_message_stays_short(save, flaser):
    fields = flaser(FOUR).split()
    fields[-2] = "h" * 3000
    fields[-1] = "9" * 3000
    log = read_log(save(flaser(FOUR) + " ".join(fields) + "\n"))
    assert len(log.skipped[0].reason) <= 180
    with pytest.raises(LogError) as raised:
        read_log(save("x,y\n" + "9" * 4000 + "\n", "f"))
    assert len(str(raised.value)) - len(str(save("", "f"))) < 300
