"""Tables: rows of points and rows of ranges."""

import numpy as np
import pytest

from labkit.logs import read_log
from labkit.support.errors import InvalidPointsError, LogError

TWO = [[1.0, 2.0], [-3.5, 4e-3]]
HALF_CIRCLE = (-np.pi / 2, np.pi / 2)


@pytest.mark.parametrize(
    "text",
    [
        "1,2\n-3.5,4e-3\n",
        " X , Y \r\n1 , 2\r\n\r\n-3.5,4e-3\r\n",
        "# a comment\n1 2 # the corner\n-3.5\t4e-3\n",
        "1,0; 2\n-3,5; 4e-3\n",
        ",x,y\n0,1,2\n1,-3.5,4e-3",
        "Y;X\n2;1\n4e-3;-3.5\n",
        '"time","x","y"\n0.25,1,2\n1.25,-3.5,4e-3\n',
        "intensity x y\n9 1 2\n8 -3.5 4e-3\n",
        "# x y quality\n1 2 9\n-3.5 4e-3 8\n",
        "1,0\t2\n-3,5\t0,004\n",
        "1,0  2,0\n-3,5 0,004\n",
        '"1,0","2"\n"-3,5","0,004"\n',
        "1,2\r-3.5,4e-3\r",
    ],
)
def test_one_scan_in_every_spelling(save, text):
    log = read_log(save(text, "corner.csv"), strict=True)
    assert (len(log), log.format, log.name) == (1, "points", "corner")
    assert log.odometry is log.reference is None
    assert np.isnan(log.stamps).all()
    assert log.scans[0].points.tolist() == TWO
    assert log.scans[0].beams is None


@pytest.mark.parametrize(
    "table",
    [
        "7.00e+00,1,2\n3.00e+00,0,0\n7.00e+00,-3.5,0.004\n",
        "scan,x,y\n7,1,2\n3,0,0\n7,-3.5,0.004\n",
        "x,y,intensity,scan\n1,2,99,4\n0,0,98,5\n-3.5,0.004,97,4\n",
    ],
)
def test_several_scans_in_the_order_of_their_first_rows(save, table):
    assert [scan.points.tolist() for scan in read_log(save(table)).scans] == [TWO, [[0.0, 0.0]]]


def test_three_columns_that_number_no_scan_are_refused_with_the_way_out(save):
    with pytest.raises(LogError, match=r"20 damaged, .*scan is 0\.5, expected a whole .*`x,y,int"):
        read_log(save("".join(f"{k}.5,{k},100\n" for k in range(20))))


def test_points_in_millimetres_are_told(save):
    path = save("".join(f"{1000 * k},{-500 * k}\n" for k in range(9)))
    assert "are they millimetres? labkit reads metres" in read_log(path).remarks[0]
    surveyed = save("".join(f"{4.5e6 + k},{5.4e6 - k}\n" for k in range(9)), "utm.csv")
    assert read_log(surveyed).remarks == ()


@pytest.mark.parametrize(
    "header",
    [
        *("r0,r1,r2,r3,r4\n", "# ranges\n", "%time,b[0],b[1],b[2],b[3],b[4]\n"),
        *("0,1,2,3,4\n", ",0,1,2,3,4\n"),  # as pandas writes them
    ],
)
def test_a_row_of_ranges_is_a_scan(save, header):
    clock = "10.5," if "time" in header or header.startswith(",") else ""
    path = save(f"{header}{clock}1,2,nan,4,inf\n{clock}5,,7,8,9\n", "scans.csv")
    log = read_log(path, angles=HALF_CIRCLE, strict=True)
    assert (log.format, len(log), log.odometry) == ("ranges", 2, None)
    assert [scan.beams.tolist() for scan in log.scans] == [[0, 1, 3], [0, 2, 3, 4]]
    np.testing.assert_allclose(log.scans[0].points[0], [0.0, -1.0], atol=1e-15)
    np.testing.assert_allclose(np.degrees(log.scans[1].angles), [-90, -45, 0, 45, 90])
    np.testing.assert_array_equal(log.stamps, [10.5 if "time" in header else np.nan] * 2)


@pytest.mark.parametrize("header", ["0,1,2,3", ",0,1,2,3"])
def test_a_header_alone_is_no_scan(save, header):
    with pytest.raises(LogError, match="a ranges log without any scan"):
        read_log(save(f"{header}\n"), angles=HALF_CIRCLE)


def test_rows_of_a_list_of_lists_are_rows(save):
    scans = read_log(
        save("[1, 2, nan, 4],\n(5, 6, 7, 8),\n{1, 2, 3, 4}\n"), angles=HALF_CIRCLE
    ).scans
    assert [scan.beams.tolist() for scan in scans] == [[0, 1, 3], [0, 1, 2, 3], [0, 1, 2, 3]]


def test_a_comma_at_the_end_of_each_row_is_no_beam(save):
    scans = read_log(save("1,2,nan,4,inf,\n5,,7,8,9,\n"), angles=HALF_CIRCLE).scans
    assert [scan.beams.tolist() for scan in scans] == [[0, 1, 3], [0, 2, 3, 4]]
    np.testing.assert_allclose(np.degrees(scans[1].angles), [-90, -45, 0, 45, 90])


@pytest.mark.parametrize(
    ("ends", "beams"),
    [((-85.9, 80.2), 9), ((1.57, -1.57), 9), ((0.0, 6.27), 360), ((359.0, 0.0), 360)],
)
def test_a_first_row_of_directions_is_no_scan(save, ends, beams):
    directions = ",".join(f"{angle:.2f}" for angle in np.linspace(*ends, beams))
    ranges = ",".join(f"{2 + np.sin(k):.2f}" for k in range(beams)) + "\n"
    with pytest.raises(LogError, match=r"run\.log:1: the numbers run evenly .*; take the row out"):
        read_log(save(f"{directions}\n{ranges}"), angles=HALF_CIRCLE)
    assert len(read_log(save(ranges), angles=HALF_CIRCLE)) == 1


@pytest.mark.parametrize("step", [0.0, 0.01])
def test_ranges_that_run_evenly_in_every_row_are_ranges(save, step):
    ramp = ",".join(f"{2 + step * k:.2f}" for k in range(40)) + "\n"

    assert len(read_log(save(2 * ramp), angles=HALF_CIRCLE)) == 2


@pytest.mark.parametrize("title", ["frame", "Frame_Index", "sweep_id", "scan_no"])
def test_a_column_that_numbers_the_scans_has_many_names(save, title):
    log = read_log(save(f"{title},x,y\n4,1,2\n4,3,4\n5,6,7\n"), strict=True)
    assert [scan.points.tolist() for scan in log.scans] == [[[1, 2], [3, 4]], [[6, 7]]]


def test_a_table_of_ranges_needs_the_directions_of_its_beams(save):
    path = save("1,2,3,4\n1,2,3,4\n")
    with pytest.raises(LogError, match=r"run\.log: rows of 4 numbers; .*angles=\(-2\.356, 2\.35"):
        read_log(path)
    with pytest.raises(InvalidPointsError, match="`angles` must be finite, got nan at index 1"):
        read_log(path, angles=[0.0, np.nan])


@pytest.mark.parametrize(
    ("titles", "row"),
    [
        ("Time,AngleMin,AngleIncrement,Ranges", "10.5,-1,0.5,1 2 3 4 5"),
        ("topic,stamp,angle_min,angle_max,ranges", '/scan,10.5,-1,1,"[1, 2, 3, 4, 5]"'),
        ("scan,stamp,angle_min,angle_max,r0,r1,r2,r3,r4", "7,10.5,-1,1,1,2,3,4,5"),
        ("sep=;\nstamp;angle_min;angle_max;r0;r1;r2;r3;r4", "10,5;-1;1;1;2;3;4;5"),
    ],
)
def test_tables_of_other_exporters(save, titles, row):
    log = read_log(save(f"{titles}\n{row}\n{row.replace('10', '11', 1)}\n"), strict=True)
    assert (log.stamps.tolist(), log.remarks) == ([10.5, 11.5], ())
    np.testing.assert_allclose(log.scans[0].angles, [-1.0, -0.5, 0.0, 0.5, 1.0])
    assert log.scans[0].ranges.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_a_pose_beside_beams_makes_no_table_of_points(save):
    path = save("x,y,theta,r0,r1,r2,r3\n0,0,0,1,2,3,4\n")
    with pytest.raises(LogError, match=r"the column 'x' is neither a clock .* nor a numbered beam"):
        read_log(path, angles=HALF_CIRCLE)


@pytest.mark.parametrize("clock", ["", "stamp,", "Time,"])
@pytest.mark.parametrize("place", [0, 2, 6])
@pytest.mark.parametrize("name", ["speed", "t", "class", "speed3"])
def test_a_column_that_is_neither_a_clock_nor_a_beam_is_refused_by_its_name(
    save, clock, place, name
):
    """The law: whatever its name and its place, it is never read as a range."""
    names = [*f"{clock}r0,r1,r2,r3,r4".split(",")]
    names.insert(place, name)
    row = ",".join("1" for _ in names)
    with pytest.raises(LogError, match=rf"the column '{name}' is neither a clock .* nor a number"):
        read_log(save(f"{','.join(names)}\n{row}\n"), angles=HALF_CIRCLE)


CLOCK = 0.1 * np.arange(8)[:, None]
POSES = np.column_stack([CLOCK, 0.3 - CLOCK, 0.05 - 0.02 * CLOCK])


@pytest.mark.parametrize("other", [CLOCK, POSES], ids=["clock", "poses"])
@pytest.mark.parametrize("behind", [True, False])
def test_columns_without_titles_that_are_no_beams_are_told(save, other, behind):
    rows = np.random.default_rng(2).uniform(1.0, 4.0, (8, 30)).round(3)
    told = "a first or a last column rises in every row, or holds negative numbers"
    mixed = np.hstack([rows, other] if behind else [other, rows])
    for table, said in ((mixed, 1), (rows, 0)):
        text = "".join(",".join(f"{value:.3f}" for value in row) + "\n" for row in table)
        remarks = read_log(save(text), angles=HALF_CIRCLE).remarks
        assert sum(remark.startswith(told) for remark in remarks) == said


def rows_of_turns(angles, stamps):
    """Rows `time,angle,range` of a room in which the scanner stands."""
    rows = zip(stamps, angles, 2.0 + np.cos(angles), strict=True)
    return "time,angle,range\n" + "".join(f"{t},{a:.4f},{r:.4f}\n" for t, a, r in rows)


@pytest.mark.parametrize("a_second", [2, 4, 12])
def test_angles_that_start_anew_part_the_sweeps_of_one_stamp(save, a_second):
    angles = np.tile(np.linspace(-3.0, 3.0, 50), 12)
    stamps = 100 + np.repeat(np.arange(12), 50) // a_second

    log = read_log(save(rows_of_turns(angles, stamps)))

    assert [len(scan) for scan in log.scans] == 12 * [50]
    assert (np.floor(log.stamps) == 100 + np.arange(12) // a_second).all()
    assert "one begins where the angles start anew, 12 in all" in log.remarks[0]


def test_points_of_several_sweeps_in_one_stamp_are_told(save):
    angles = np.tile(np.linspace(-3.0, 3.0, 50), 12)
    rows = zip(np.arange(600) // 200, 2 * np.cos(angles), 2 * np.sin(angles), strict=True)
    text = "time,x,y\n" + "".join(f"{t},{x:.3f},{y:.3f}\n" for t, x, y in rows)
    assert "points of one stamp go round 4.0 times" in read_log(save(text)).remarks[0]


@pytest.mark.parametrize("polar", [True, False])
@pytest.mark.parametrize(("gone", "left"), [((25, 0), "first"), ((0, 30), "last"), ((2, 3), "")])
def test_a_first_or_last_turn_that_was_cut_is_no_scan(save, polar, gone, left):
    turns = np.repeat(np.arange(6), 50)
    angles = np.tile(np.linspace(-3.0, 3.0, 50), 6)
    r = 2.0 + np.cos(angles)
    x, y = (angles, r) if polar else (r * np.cos(angles), r * np.sin(angles))
    part = slice(gone[0], len(turns) - gone[1])
    rows = zip(turns[part], x[part], y[part], strict=True)
    titles = "scan,angle,range" if polar else "scan,x,y"

    log = read_log(save(f"{titles}\n" + "".join(f"{k},{a},{b}\n" for k, a, b in rows)))

    assert len(log) == (5 if left else 6)
    assert len(log.remarks) == bool(left)
    assert all(f"the {left} scan covers" in remark for remark in log.remarks)


def test_two_recordings_in_one_file_are_two_and_are_told(save):
    rows = "".join(f"{k % 5},{a},{1.0 + k}\n" for k in range(10) for a in (0.0, 1.0, 2.0))
    log = read_log(save(f"scan,angle,range\n{rows}"))
    assert [scan.ranges[0] for scan in log.scans] == [1.0 + k for k in range(10)]
    assert "the numbers of the scans start anew 1 times" in log.remarks[0]
