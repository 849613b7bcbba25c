"""The law of doors: a file is read as what it says, or refused with what it says.

Each table is written from one set of sweeps, in a spelling that the test draws, and has to be read
back as these sweeps.
"""

import re
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.logs import read_log
from labkit.support.errors import InvalidParameterError, LogError

K, B = 6, 25  # scans, beams
ANGLES = np.linspace(-1.2, 1.2, B)
STAMPS = 1.7e9 + 0.1 * np.arange(K)
RANGES = np.random.default_rng(0).uniform(1.0, 4.0, (K, B)).round(3)
ENDS = (ANGLES[0], ANGLES[-1])

ANGLE_TITLES = {
    **dict.fromkeys(["angle", "theta [rad]", "Bearing", "azimuth_rad"], 1.0),
    **dict.fromkeys(["angle_deg", "theta (deg)", "bearing [°]", "phi_degrees"], np.pi / 180),
}
RANGE_TITLES = {
    **dict.fromkeys(["range", "r", "Distance", "dist_m", "range (m)"], 1.0),
    **dict.fromkeys(["range_mm", "distance [mm]", "r (mm)"], 1e-3),
    "dist_cm": 1e-2,
}
CLOCK_TITLES = {
    **dict.fromkeys(["stamp", "time", "Timestamp [s]", "%time", "field.header.stamp"], 1.0),
    **dict.fromkeys(["stamp_ms", "time [ms]"], 1e-3),
    "time_us": 1e-6,
    "timestamp_ns": 1e-9,
    "stamp [ns]": 1e-9,
}
UNITS = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
BEAM_TITLES = {
    **dict.fromkeys(
        ["r{}", "ranges[{}]", "ranges_{}", "field.ranges{}", "/scan/ranges[{}]", "{}"], 1.0
    ),
    **dict.fromkeys(["r{}_mm", "range_mm_{}", "/scan/ranges_mm[{}]"], 1e-3),
}
separators = st.sampled_from([",", ";", ", "])


def expect_scans(log, stamps=None):
    """The scans of `RANGES`, and their stamps."""
    assert len(log) == K
    for scan, ranges in zip(log.scans, RANGES, strict=True):
        points = ranges[:, None] * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
        np.testing.assert_allclose(scan.points, points, atol=1e-4)
    if stamps is not None:
        np.testing.assert_allclose(log.stamps, stamps, atol=1e-6)


def write_table(path, titles, rows, separator=",", quoted=False):
    fields = [[f"{v:.10g}" if isinstance(v, float) else v for v in row] for row in rows]
    if separator == ";":
        fields = [[field.replace(".", ",") for field in row] for row in fields]
    lines = [titles, *fields]
    if quoted:
        lines = [[f'"{field}"' for field in line] for line in lines]
    path.write_text("".join(separator.join(map(str, line)) + "\n" for line in lines))


@given(
    angle=st.sampled_from(list(ANGLE_TITLES)),
    distance=st.sampled_from(list(RANGE_TITLES)),
    number=st.sampled_from(["scan", "Scan_ID", "sweep", "stamp", "time [s]", None]),
    order=st.permutations(range(4)),
    separator=separators,
    quoted=st.booleans(),
)
def test_a_polar_table_is_read_by_its_titles(
    scratch, angle, distance, number, order, separator, quoted
):
    titles = [number or "quality", angle, distance, "intensity"]
    stamps = STAMPS if number and number.lower().startswith(("stamp", "time")) else np.arange(K)
    angles, ranges = ANGLES / ANGLE_TITLES[angle], RANGES / RANGE_TITLES[distance]
    rows = [
        [f"{stamps[k]:.3f}" if number else "7", float(angles[b]), float(ranges[k, b]), "9"]
        for k in range(K)
        for b in range(B)
    ]
    rows = [[row[k] for k in order] for row in rows]
    write_table(scratch, [titles[k] for k in order], rows, separator, quoted)

    log = read_log(scratch, strict=True)

    expect_scans(log, STAMPS if stamps is STAMPS else None)
    assert number or "one begins where the angles start anew, 6 in all" in log.remarks[0]


@given(
    beam=st.sampled_from(list(BEAM_TITLES)),
    first=st.sampled_from([0, 1]),
    clock=st.sampled_from([None, *CLOCK_TITLES]),
    order=st.permutations(range(B + 1)),
    separator=separators,
    quoted=st.booleans(),
)
def test_a_table_of_ranges_is_read_by_its_titles(
    scratch, beam, first, clock, order, separator, quoted
):
    order = sorted(order) if beam == "{}" else order
    titles = [clock or "seq", *(beam.format(k + first) for k in range(B))]
    unit, ranges = CLOCK_TITLES.get(clock, 1.0), RANGES / BEAM_TITLES[beam]
    rows = [[f"{STAMPS[k] / unit:.3f}", *ranges[k].tolist()] for k in range(K)]
    rows = [[row[k] for k in order] for row in rows]
    write_table(scratch, [titles[k] for k in order], rows, separator, quoted)

    log = read_log(scratch, strict=True, angles=ENDS)

    expect_scans(log, STAMPS if clock else None)
    assert log.remarks == ()


MESSAGE = ["field.angle_min", "field.angle_max", "field.angle_increment", "field.range_max"]


@pytest.mark.parametrize("listed", ["", "[{}]", '"({})"', '"{}"', "bare"])
@pytest.mark.parametrize("clock", ["field.header.stamp", "header.stamp.secs,header.stamp.nsecs"])
@pytest.mark.parametrize("maximum", ["30.0", "0.0", "inf"])
def test_the_table_of_a_laser_scan_needs_nothing_else(save, listed, clock, maximum):
    """As `rostopic echo -p` and other exporters of bags write it."""
    beams = "ranges" if listed else ",".join(f"field.ranges{k}" for k in range(B))
    text = f"%time,field.header.seq,{clock},field.header.frame_id,{','.join(MESSAGE)},{beams}\n"
    step = ANGLES[1] - ANGLES[0]
    for k, ranges in enumerate(RANGES.tolist()):
        nanoseconds = round(STAMPS[k] * 1e9)
        parts = divmod(nanoseconds, 10**9) if "secs" in clock else [nanoseconds]
        stamp = ",".join(map(str, parts))
        join = " " if listed == "bare" else ","
        row = (listed if "{" in listed else "{}").format(join.join(map(str, ranges)))
        told = f"{ENDS[0]},{ENDS[1]},{step},{maximum}"
        text += f"{nanoseconds + 10**8},{k},{stamp},laser,{told},{row}\n"

    log = read_log(save(text), strict=True)

    expect_scans(log, STAMPS)
    assert any("counts as unknown" in remark for remark in log.remarks) == (maximum == "0.0")


@pytest.mark.parametrize("unit", ["ms", "us", "ns", "date"])
@pytest.mark.parametrize("epoch", [0.0, 1.7e9])
def test_a_clock_that_does_not_name_its_unit_is_read_and_told(save, unit, epoch):
    stamps = epoch + 0.1 * np.arange(K)
    fields = [f"{stamp / UNITS.get(unit, 1.0):.0f}" for stamp in stamps]
    if unit == "date":
        fields = [datetime.fromtimestamp(stamp, UTC).isoformat() for stamp in stamps]
    rows = [",".join([field, *map(str, row)]) for field, row in zip(fields, RANGES, strict=True)]
    titles = ",".join(["time", *(f"r{k}" for k in range(B))])

    log = read_log(save("\n".join([titles, *rows])), angles=ENDS, strict=True)

    expect_scans(log, stamps)
    if unit == "date" or epoch:  # the size of a date tells its unit surely
        assert log.remarks == ()
        return
    names = {"ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
    assert f"no seconds: it is read as {names[unit]}" in log.remarks[0]
    told = re.search("the title `(.*?)` of its column would say", log.remarks[0])[1]
    said = read_log(save("\n".join([titles.replace("time", told), *rows])), angles=ENDS)
    expect_scans(said, stamps)
    assert said.remarks == ()


def test_a_time_of_day_is_a_clock(save):
    rows = [f"13:12:5{k}.25,{','.join(map(str, row))}" for k, row in enumerate(RANGES)]
    titles = ",".join(["time", *(f"r{k}" for k in range(B))])
    log = read_log(save("\n".join([titles, *rows])), angles=ENDS, strict=True)
    np.testing.assert_allclose(np.diff(log.stamps), np.ones(K - 1))
    assert log.remarks == ()


@pytest.mark.parametrize(
    ("titles", "row", "message"),
    [
        ("a,b", "1,2", "the columns are a, b; points need columns `x` and `y`, or `angle` and"),
        ("flag,raw_angle,distance", "1,2,3", "the columns are flag, raw_angle, distance; points"),
        ("scan,angle,speed", "1,2,3", "the columns are scan, angle, speed; points need"),
        ("angle,range", "1,2\n359,2", "'angle' must be radians within one turn, .* `angle_deg`"),
        ("theta,angle,range", "1,1,2", "'theta' and 'angle' are both taken for angle"),
        ("r0,r1,r2,r4", "1,1,1,1", "'r0' to 'r4' are numbered with a gap, at 3"),
        ("r0,r1,r1,r2", "1,1,1,1", "'r0' to 'r2' are numbered with one number twice, at 2"),
        ("r0_mm,r1_mm,r2_mm,r3", "1,1,1,1", "the beams have units of their own, , mm"),
        ("x_deg,y", "1,2", "the columns are x_deg, y; points need"),
        ("range_s,angle", "1,2", "the columns are range_s, angle; points need"),
    ],
)
def test_titles_that_are_no_table_are_refused_by_their_words(save, titles, row, message):
    with pytest.raises(LogError, match=message):
        read_log(save(f"{titles}\n{row}\n"))


@pytest.mark.parametrize("unit", ["radians", "degrees"])
@pytest.mark.parametrize("numbered", [True, False])
def test_directions_without_titles_that_run_evenly_are_read_and_told(save, unit, numbered):
    angles = np.degrees(ANGLES) if unit == "degrees" else ANGLES
    scans = range(K) if numbered else [0]
    rows = [f"{k},{a:.4f},{r}\n" for k in scans for a, r in zip(angles, RANGES[k], strict=True)]

    log = read_log(save("".join(row if numbered else row[2:] for row in rows)))

    assert f"read as angles in {unit} and ranges" in log.remarks[0]
    for scan, ranges in zip(log.scans, RANGES, strict=False):
        points = ranges[:, None] * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
        np.testing.assert_allclose(scan.points, points, atol=1e-3)


def test_columns_without_titles_that_run_one_way_unevenly_are_told(save):
    angles = ANGLES + np.random.default_rng(3).uniform(-0.04, 0.04, B)
    rows = "".join(f"{a},{r}\n" for a, r in zip(angles, RANGES[0], strict=True))
    assert "if they are angles and ranges, say so in a header" in read_log(save(rows)).remarks[0]


def test_points_of_walls_without_titles_are_points(save):
    rows = "".join(f"{k},{2 * np.cos(a)},{2 * np.sin(a)}\n" for k in range(3) for a in ANGLES)
    assert (read_log(save(rows)).format, read_log(save(rows)).remarks) == ("points", ())


# What the caller says


@pytest.fixture
def logs(save, flaser, robotlaser):
    """A log of each kind of file that holds ranges, with the arguments that it needs."""
    polar = "".join(
        f"{k},{a},{r}\n" for k in range(K) for a, r in zip(ANGLES, RANGES[k], strict=True)
    )
    rows = "".join(",".join(map(str, row)) + "\n" for row in RANGES)
    return {
        "carmen": (save("".join(map(flaser, RANGES.tolist())), "carmen.log"), {}),
        "robotlaser": (save("".join(map(robotlaser, RANGES.tolist())), "robot.log"), {}),
        "polar": (save("scan,angle,range\n" + polar, "polar.csv"), {}),
        "ranges": (save(rows, "ranges.csv"), {"angles": ENDS}),
    }


@pytest.mark.parametrize("kind", ["carmen", "robotlaser", "polar", "ranges"])
def test_a_mirrored_scanner_looks_to_the_other_side(logs, kind):
    path, needed = logs[kind]
    plain, mirrored = (read_log(path, mirrored=side, **needed) for side in (False, True))
    for a, b in zip(plain.scans, mirrored.scans, strict=True):
        np.testing.assert_array_equal(a.points * [1.0, -1.0], b.points)
        np.testing.assert_array_equal(a.angles, -b.angles)


@pytest.mark.parametrize("kind", ["carmen", "robotlaser", "polar", "ranges"])
def test_the_caller_s_band_goes_before_the_declared_one(logs, kind):
    path, needed = logs[kind]
    log = read_log(path, range_min=1.5, range_max=3.5, **needed)
    for scan, row in zip(log.scans, RANGES, strict=True):
        assert scan.beams.tolist() == np.flatnonzero((row > 1.5) & (row < 3.5)).tolist()


@pytest.mark.parametrize("kind", ["carmen", "robotlaser", "ranges"])
def test_the_caller_s_directions_go_before_the_declared_ones(logs, kind):
    expect_scans(read_log(logs[kind][0], angles=ENDS))


OPTIONS = {
    "angles": (-1.0, 1.0),
    "no_return": 3.0,
    "laser_offset": (0.1, 0.0, 0.0),
    "time_increment": 1e-4,
    "angle_unit": "rad",
    "blind_beams": [0],
    "frame": "",
    "topic": "/scan",
    "odometry_topic": "/odom",
}
USELESS = {
    "carmen": {"topic", "odometry_topic", "frame"},
    "ranges": {"laser_offset", "topic", "odometry_topic"},
    "polar": OPTIONS.keys() - {"no_return", "time_increment", "angle_unit", "blind_beams"},
    "points": OPTIONS.keys(),
}


@pytest.mark.parametrize("option", OPTIONS)
@pytest.mark.parametrize("kind", USELESS)
def test_an_argument_that_a_format_cannot_use_is_refused(logs, save, kind, option):
    """The law: each argument × each format."""
    logs["points"] = save("x,y\n1,2\n", "points.csv"), {}
    path, needed = logs[kind]
    given = needed | {option: OPTIONS[option]}
    if option in USELESS[kind]:
        with pytest.raises(InvalidParameterError, match=f"`{option}` cannot be used for .*{path}"):
            read_log(path, **given)
    else:
        assert len(read_log(path, **given)) == K
