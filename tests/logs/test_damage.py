"""Damage in lines and in files of every format."""

import gzip
import importlib.util
import lzma

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from labkit.logs import read_log, read_tum
from labkit.support.errors import InvalidParameterError, LogError
from tests.logs.test_read_log import zipped

# What each field of a line is: a word, one that nobody reads (-), a count, a range, a place, the
# number of a scan, or any finite number; and what it cannot be.
FIELDS = {
    "flaser": "wcrrrrppfppff--",
    "robotlaser": "w-ffff--crrrrcppfppf-----f--",
    "g2o": "w-ppf",
    "points": "pp",
    "numbered": "spp",
    "ranges": "rrrr",
    "clocked": "frrrr",
    "tum": "fppfffff",
}
NO_NUMBER = ["x", "1..0", "0x1f", "--1"]
NOT_FINITE = [*NO_NUMBER, "nan", "-inf", "1e999"]
BAD = {
    "c": [*NOT_FINITE, "-1", "1.5", "99"],
    "r": NO_NUMBER,
    "p": [*NOT_FINITE, "-2e9"],
    "s": [*NOT_FINITE, "0.5"],
    "f": NOT_FINITE,
}
ROWS = 5


class ByFormat(dict):
    """What a fixture holds of each format; short, where Hypothesis shows an example that fails."""

    def __repr__(self):
        return f"<{len(self)} formats>"


@pytest.fixture(scope="module")
def good(flaser, robotlaser):
    """Lines of each format, as fields; the line above them; and what parts the fields."""
    path = [(0.5 * k, 0.1 * k, 0.2 * k) for k in range(ROWS)]
    sweeps = [[f"{1.5 + k}", "2.2", "3.5", "4.1"] for k in range(ROWS)]
    formats = {
        "flaser": ([flaser(r, p).split() for r, p in zip(sweeps, path, strict=True)], "", " "),
        "robotlaser": ([robotlaser(r).split() for r in sweeps], "# a run\n", " "),
        "g2o": ([f"VERTEX_SE2 {k} {k} 0 0".split() for k in range(ROWS)], "", " "),
        "points": ([sweep[:2] for sweep in sweeps], "", ","),
        "numbered": ([[str(k), *sweep[:2]] for k, sweep in enumerate(sweeps)], "scan,x,y\n", ","),
        "ranges": (sweeps, "", ";"),
        "clocked": ([[str(k), *r] for k, r in enumerate(sweeps)], "time,r0,r1,r2,r3\n", ","),
        "tum": ([f"{k} {k} 2 0 0 0 0 1".split() for k in range(ROWS)], "# a path\n", " "),
    }
    return ByFormat(formats)


def rows_of(log):
    """The points of a log, scan by scan or, where there is one, point by point."""
    scans = [scan.points.tolist() for scan in log.scans]
    return scans if len(scans) > 1 else scans[0]


@given(data=st.data(), format=st.sampled_from(list(FIELDS)), k=st.integers(1, ROWS - 1))
def test_a_damaged_line_alone_is_left_out_and_named(scratch, good, robotlaser, data, format, k):
    """The law: of any format, any line, any field that is read, any way to spoil it."""
    rows, header, comma = good[format]
    column = data.draw(st.integers(0, len(FIELDS[format]) - 1))
    kind = FIELDS[format][column]
    spoiled = list(rows[k])
    how = data.draw(st.sampled_from(["cut", "add", *BAD.get(kind, [])]))
    if how == "cut":
        del spoiled[-1 if kind == "w" else column]
    elif how == "add":
        spoiled.insert(column + 1, "7")
    else:
        spoiled[column] = how
    lines = [comma.join(each) + "\n" for each in (*rows[:k], spoiled, *rows[k + 1 :])]
    bad = [k + 1 + bool(header)]
    if format == "g2o":  # a scan goes with its vertex
        lines = [line + robotlaser([1.5, 2.5 + n]) for n, line in enumerate(lines)]
        bad = [2 * k + 1, 2 * k + 2]
    scratch.write_text(header + "".join(lines))
    beams = {"angles": (-1, 1)} if format in {"ranges", "clocked"} else {}
    with pytest.raises(LogError) as raised:
        read_tum(scratch) if format == "tum" else read_log(scratch, strict=True, **beams)
    assert str(raised.value).startswith(f"{scratch}:{bad[0]}: ")
    if how in BAD.get(kind, []) and how != "99":
        assert how.lstrip("-").removeprefix("1e").removesuffix("e9") in str(raised.value)
    if format != "tum":
        log = read_log(scratch, **beams)
        assert [each.line for each in log.skipped] == bad
        assert str(log.skipped[0]) == str(raised.value)
        del lines[k]
        scratch.write_text(header + "".join(lines))
        assert rows_of(log) == rows_of(read_log(scratch, strict=True, **beams))


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress])
def test_a_packed_file_that_is_cut_gives_its_scans_until_there(save, flaser, pack):
    rng = np.random.default_rng(3)
    lines = [flaser(rng.uniform(1.0, 4.0, 180).round(2).tolist()) for _ in range(60)]
    packed = pack("".join(lines).encode())
    whole = read_log(save(packed))

    log = read_log(path := save(packed[: len(packed) * 3 // 4]))

    assert 0 < len(log) < len(whole)
    assert rows_of(log)[:-1] == rows_of(whole)[: len(log) - 1]
    assert log.skipped[-1].reason == "the packed file breaks off here"
    with pytest.raises(LogError, match=r"run.log:\d+: "):
        read_log(path, strict=True)


@pytest.fixture(scope="module")
def good_files(run, robotlaser, tmp_path_factory):
    """A small log of each format and packing."""
    graph = "".join(f"VERTEX_SE2 {k} {k} 0 0\n{robotlaser([1.0, 2.0, 3.0])}" for k in range(4))
    files = {
        "run.log": run.encode(),
        "run.g2o": graph.encode(),
        "xy.csv": b"scan,x,y\n" + b"".join(b"%d,1.5,%d\n" % (k // 9, k) for k in range(30)),
        "ranges.csv": 6 * b"1.0,2.5,inf,4.0,5.0\n",
        "run.log.gz": gzip.compress(run.encode(), mtime=0),
        "run.log.zip": zipped({"run.log": run}),
    }
    if not importlib.util.find_spec("rosbags"):
        return ByFormat(files)
    from tests.logs.test_rosbag import Bag  # noqa: PLC0415 (needs rosbags)

    for ros in (1, 2, "mcap"):
        bag = Bag(tmp_path_factory.mktemp("bags") / ("run.bag" if ros == 1 else "run"), ros)
        for k in range(6):
            bag.odometry(10.0 + k, 0.3 * k, 0.0, 0.05 * k)
            bag.scan(10.2 + k)
        path = bag.close()
        inside = [path] if path.is_file() else [f for f in path.iterdir() if f.suffix != ".yaml"]
        files[inside[0].name] = inside[0].read_bytes()
    return ByFormat(files)


WOUNDS = st.lists(
    st.tuples(
        st.integers(0, 10**6),
        st.sampled_from([0, 1, 1, 4, 40, 400]),  # bytes that go
        st.sampled_from([b"nan", b"1e309", b"-1", b"9" * 30, b"8.191", b"\n", b"\0", b"FLASER 2 "])
        | st.binary(max_size=12),
    ),
    min_size=1,
    max_size=3,
)


@given(which=st.integers(0, 10**6), wounds=WOUNDS, strict=st.booleans())
@example(which=3, wounds=[(5, 0, b"\n")], strict=False)  # ranges.csv begins like points
def test_a_damaged_file_is_refused_or_what_it_gives_is_whole(
    scratch, good_files, which, wounds, strict
):
    """The law: of any format and packing, whatever bytes are lost, changed or put in."""
    name = list(good_files)[which % len(good_files)]
    data = good_files[name]
    for place, gone, put in wounds:
        start = place % (len(data) + 1)
        data = data[:start] + put + data[start + gone :]
    path = scratch.with_name(name)
    path.write_bytes(data)
    log, told, useless = None, [], ""
    try:
        log = read_log(
            path, strict=strict, **({"angles": (-1.5, 1.5)} if name == "ranges.csv" else {})
        )
        assert not name.endswith((".gz", ".zip")) or log.skipped == ()  # all or nothing
        told = [skipped.reason for skipped in log.skipped]
    except LogError as error:
        told = [str(error).replace(str(path), "").partition("; labkit reads")[0]]
    except InvalidParameterError as error:
        useless = error.parameter  # of a file that the damage made one of points
    assert not useless or (name, useless) == ("ranges.csv", "angles")
    assert all(len(each) <= 300 for each in told)
    if log is not None:
        assert len(log) > 0
        assert all(np.isfinite(scan.points).all() for scan in log.scans)
        for poses in (each for each in (log.odometry, log.reference) if each is not None):
            silent = np.isnan(poses).all(axis=1) & (log.format == "ros")
            assert np.isfinite(poses[~silent]).all()
