import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from labkit.errors import LogError
from labkit.logs import read_log, read_points

TWO = [[1.0, 2.0], [-3.5, 4e-3]]


@pytest.mark.parametrize(
    "text",
    [
        "1,2\n-3.5,4e-3\n",
        "x,y\n1,2\n-3.5,4e-3",
        " X , Y \r\n1 , 2\r\n\r\n-3.5,4e-3\r\n",
        "# a comment\n1 2 # the corner\n-3.5\t4e-3\n",
        "x y\n1 2\n-3.5   4e-3\n",
    ],
)
def test_one_scan_in_every_spelling(save, text):
    path = save(text, "corner.csv")
    log = read_log(path, strict=True)
    assert (len(log), log.format, log.name) == (1, "points", "corner")
    assert log.odometry is log.reference is None
    assert np.isnan(log.stamps).all()
    assert log.scans[0].points.tolist() == read_points(path).points.tolist() == TWO
    assert log.scans[0].beams is None


@pytest.mark.parametrize("header", ["", "scan,x,y\n"])
def test_several_scans_in_the_order_of_their_first_rows(save, header):
    path = save(header + "7,1,2\n3,0,0\n7,-3.5,0.004\n")
    assert [scan.points.tolist() for scan in read_log(path).scans] == [TWO, [[0.0, 0.0]]]
    with pytest.raises(LogError, match=r"run\.log: 2 scans, expected one"):
        read_points(path)


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("1", "1 fields, expected 2"),
        ("1,2,3", "3 fields, expected 2"),
        ("1,,2", "3 fields, expected 2"),
        ("1,", "y is '', expected a finite number"),
        ("one,2", "x is 'one', expected a finite number"),
        ("1,nan", "y is 'nan', expected a finite number"),
        ("x,y", "x is 'x', expected a finite number"),
        ("3.4028235e38,0", "the point is (3.40282e+38, 0), expected to lie within 1e+09 m"),
        ("1,-2e9", "the point is (1, -2e+09), expected to lie within 1e+09 m"),
    ],
)
def test_a_damaged_row_is_skipped_or_named(save, row, reason):
    path = save(f"1,2\n{row}\n-3.5,4e-3\n")
    log = read_log(path)
    assert log.scans[0].points.tolist() == TWO
    assert [(s.line, s.reason) for s in log.skipped] == [(2, reason)]
    with pytest.raises(LogError, match=r"run\.log:2: ") as raised:
        read_log(path, strict=True)
    assert str(raised.value).endswith(reason)
    with pytest.raises(LogError, match=r"run\.log:2: "):
        read_points(path)


def test_a_table_of_places_that_do_not_exist_is_still_one_of_points(save):
    path = save("1e200,1e200\n2e200,1e200\n")
    for read in (read_log, read_points):
        with pytest.raises(LogError, match=r"run\.log:.*1: the point is \(1e\+200, 1e\+200\), ex"):
            read(path)


def test_surveyed_coordinates_are_points(save):
    utm = [[4.5e6, 5.41e6], [4.5e6 + 0.25, 5.41e6 - 1e-3]]
    assert read_points(save("".join(f"{x},{y}\n" for x, y in utm))).points.tolist() == utm


def test_a_damaged_first_row_does_not_hide_the_others(save):
    log = read_log(save("1,\n1,2\n-3.5,4e-3\n"))
    assert log.scans[0].points.tolist() == TWO
    assert log.skipped[0].line == 1


def test_a_scan_number_that_is_none(save):
    log = read_log(save("scan,x,y\n0,1,2\nfirst,1,2\n"))
    assert str(log.skipped[0]).endswith(":3: the scan number is 'first', expected a finite number")


def test_a_header_alone(save):
    for read in (read_log, read_points):
        with pytest.raises(LogError, match=r"run\.log: a table without any point, expected rows"):
            read(save("x,y\n"))


def test_read_points_of_something_else(save, run):
    with pytest.raises(LogError, match=r"run\.log: not a table of points, expected rows `x,y`"):
        read_points(save(run))
    with pytest.raises(LogError, match="no such file"):
        read_points("nowhere.csv")


@given(
    points=hnp.arrays(
        np.float64,
        st.tuples(st.integers(1, 20), st.just(2)),
        elements=st.floats(-1e9, 1e9),
    )
)
def test_points_come_back_bit_for_bit(scratch, points):
    scratch.write_text("x,y\n" + "".join(f"{x!r},{y!r}\n" for x, y in points.tolist()))
    assert (read_points(scratch).points == points).all()
    assert (read_log(scratch).scans[0].points == points).all()
