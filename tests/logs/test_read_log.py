"""Any file: its packing, its format, its bounds, and what is told of its damage."""

import gzip
import importlib.util
import io
import os
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.logs import lines, read_log, read_tum
from labkit.support.errors import InvalidPointsError, LogError


def zipped(members, method=zipfile.ZIP_DEFLATED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return buffer.getvalue()


PACKINGS = {
    "plain": lambda text: text.encode(),
    "bom": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "windows": lambda text: text.replace("\n", "\r\n").encode(),
    "gzip": lambda text: gzip.compress(text.encode()) + 100 * b"\0",
    "two gzip members": lambda text: (
        gzip.compress(text[:100].encode()) + gzip.compress(text[100:].encode())
    ),
    "zip": lambda text: zipped({"run.log": text}),
    "stored zip": lambda text: zipped({"run.log": text}, zipfile.ZIP_STORED),
    "zip from a Mac": lambda text: zipped({"a/": "", "__MACOSX/._run": "x", "a/run.log": text}),
}


@pytest.mark.parametrize("packing", PACKINGS)
def test_packing_and_format_are_told_from_the_content(save, run, packing):
    log = read_log(save(PACKINGS[packing](run), "run.csv"), strict=True)
    assert (len(log), log.format, log.name) == (5, "carmen", "run")
    assert repr(log) == "Log(run: 5 scans, carmen, odometry)"


@pytest.mark.parametrize(
    ("name", "expected"),
    [("intel.log.gz", "intel"), ("a.b.g2o.zip", "a.b"), (".log", ".log"), ("run-2.1", "run-2.1")],
)
def test_the_name_of_a_run_goes_without_suffixes(save, run, name, expected):
    assert read_log(save(run, name)).name == expected


def encrypted():
    packed = bytearray(zipped({"run.log": "text"}))
    packed[6] |= 1
    packed[packed.index(b"PK\x01\x02") + 8] |= 1
    return bytes(packed)


UNREADABLE = [
    (b"", "f: the file is empty"),
    (gzip.compress(b" \n\n", mtime=0), "f: the file is empty"),
    (b"\x7fELF\0\0\0", "f: unknown format, the file begins with binary data; labkit reads CARMEN"),
    (b"Dear reader,\n", r"f: unknown format, the file begins with 'Dear reader,'; .*from_ranges"),
    (zipped({"a": "x", "b": "y"}), r"exactly one log, got 2; unpack it and name one file"),
    (encrypted(), "f: the archive cannot be unpacked: .*encrypted"),
]


@pytest.mark.parametrize(("content", "message"), UNREADABLE)
def test_a_file_that_is_no_log(save, content, message):
    with pytest.raises(LogError, match=message):
        read_log(save(content, "f"))


def test_paths_with_nothing_to_read(tmp_path):
    with pytest.raises(LogError, match=r"gone\.log: no such file"):
        read_log(tmp_path / "gone.log")
    with pytest.raises(LogError, match="is a directory, expected a file"):
        read_log(tmp_path)
    with pytest.raises(LogError, match=r"cannot be read: .*null"):
        read_log("a\0b")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a pipe with a name")
def test_a_pipe_and_a_device_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        for read in (read_log, read_tum):
            with pytest.raises(LogError, match="is a pipe or a device, expected a file"):
                read(path)


def test_options_that_do_not_fit(save, run):
    with pytest.raises(InvalidPointsError, match="`laser_offset` must be 3 finite numbers"):
        read_log(save(run), laser_offset=(0.0, 0.0))
    for parameter in ("topic", "odometry_topic"):
        with pytest.raises(LogError, match=rf"run\.log: is no ROS bag; leave .*`{parameter}`"):
            read_log(save(run), **{parameter: "/scan"})


@pytest.mark.parametrize("packing", ["gzip", "zip"])
def test_a_damaged_archive_is_refused(save, flaser, packing):
    rng = np.random.default_rng(2)
    text = "".join(flaser(rng.uniform(1.0, 9.0, 40).round(6)) for _ in range(40))
    packed = bytearray(PACKINGS[packing](text).rstrip(b"\0"))
    flipped = packed.copy()
    flipped[len(packed) * 3 // 4] ^= 0xFF
    for damaged in (packed[: len(packed) // 2], packed[:-20], flipped):
        with pytest.raises(LogError, match=r"run\.log: the archive cannot be unpacked: .*get it"):
            read_log(save(bytes(damaged)))


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
        "run.zip": zipped({"run.log": run}),
    }
    if not importlib.util.find_spec("rosbags"):
        return files
    from test_rosbag import Bag  # noqa: PLC0415 (needs rosbags)

    for ros in (1, 2, "mcap"):
        bag = Bag(tmp_path_factory.mktemp("bags") / "run", ros)
        for k in range(6):
            bag.odometry(10.0 + k, 0.3 * k, 0.0, 0.05 * k)
            bag.scan(10.2 + k)
        path = bag.close()
        inside = [path] if path.is_file() else [f for f in path.iterdir() if f.suffix != ".yaml"]
        files[f"run-{ros}{inside[0].suffix}"] = inside[0].read_bytes()
    return files


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
def test_a_damaged_file_is_refused_or_what_it_gives_is_whole(
    scratch, good_files, which, wounds, strict
):
    data = list(good_files.values())[which % len(good_files)]
    for place, gone, put in wounds:
        start = place % (len(data) + 1)
        data = data[:start] + put + data[start + gone :]
    scratch.write_bytes(data)
    log, told = None, []
    try:
        log = read_log(scratch, strict=strict, angles=(-1.5, 1.5))
        told = [skipped.reason for skipped in log.skipped]
    except LogError as error:
        told = [str(error).replace(str(scratch), "")]
    assert all(len(each) <= 300 for each in told)
    if log is not None:
        assert len(log) > 0
        assert all(np.isfinite(scan.points).all() for scan in log.scans)
        assert all(p is None or np.isfinite(p).all() for p in (log.odometry, log.reference))


def test_a_line_that_is_too_long_is_refused(save, flaser, monkeypatch):
    monkeypatch.setattr(lines, "MAX_LINE_BYTES", 1000)
    path = save(flaser([1.0, 2.0]) + "9" * 5000)
    with pytest.raises(LogError, match=r"run\.log:2: more than 1,000 bytes"):
        read_log(path)


@pytest.mark.parametrize("packing", ["plain", "gzip", "zip"])
def test_a_file_that_is_too_large_is_refused_with_the_way_out(save, run, packing, monkeypatch):
    path = save(PACKINGS[packing](run))
    size = len(run.encode())
    monkeypatch.setattr(lines, "MAX_BYTES", size)
    assert len(read_log(path)) == 5
    monkeypatch.setattr(lines, "MAX_BYTES", size - 1)
    with pytest.raises(LogError, match=rf"more than {size - 1} bytes, unpacked; cut it in pieces"):
        read_log(path)


@pytest.mark.parametrize("content", [bytes(64 << 20), (b"# " + 1000 * b"x" + b"\n") * 20_000])
def test_a_bomb_takes_little_memory(save, content, monkeypatch):
    monkeypatch.setattr(lines, "MAX_BYTES", 32 << 20)
    path = save(gzip.compress(content))
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match=r"unknown format|more than .* bytes"):
            read_log(path)
        assert tracemalloc.get_traced_memory()[1] < 24 << 20
    finally:
        tracemalloc.stop()
