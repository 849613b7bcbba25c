"""Any file: its packing, its format, its bounds, and what is told of its damage."""

import gzip
import io
import os
import tracemalloc
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labkit.errors import InvalidParameterError, InvalidPointsError, LogError
from labkit.logs import Log, lines, read_log, read_tum
from labkit.scan import Scan


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
@pytest.mark.parametrize("name", ["run.gz", "run.csv"])
def test_packing_and_format_are_told_from_the_content(save, run, packing, name):
    log = read_log(save(PACKINGS[packing](run), name), strict=True)
    assert (len(log), log.format, log.name) == (5, "carmen", "run")


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
    (b" \n\n", "f: the file is empty"),
    (gzip.compress(b"", mtime=0), "f: the file is empty"),
    (b"PK\x03\x04", "f: the archive cannot be unpacked: File is not a zip file; get it again"),
    (b"\x7fELF\0\0\0", "f: unknown format, the file begins with binary data; labkit reads CARMEN"),
    (b"Dear reader,\n", r"f: unknown format, the file begins with 'Dear reader,'; .*from_ranges"),
    (zipped({}), r"f: a zip archive must hold exactly one log, got 0"),
    (zipped({"a": "x", "b": "y"}), r"exactly one log, got 2; unpack it and name one file"),
    (encrypted(), "f: the archive cannot be unpacked: .*encrypted"),
]


@pytest.mark.parametrize(("content", "message"), UNREADABLE)
def test_a_file_that_is_no_log(save, content, message):
    with pytest.raises(LogError, match=message):
        read_log(save(content, "f"))


def test_paths_with_nothing_to_read(tmp_path, save):
    with pytest.raises(LogError, match=r"gone\.log: no such file"):
        read_log(tmp_path / "gone.log")
    with pytest.raises(LogError, match="is a directory, expected a file"):
        read_log(tmp_path)
    with pytest.raises(LogError, match="cannot be read: Not a directory"):
        read_log(save("x") / "inside.log")
    with pytest.raises(LogError, match=r"cannot be read: .*null"):
        read_log("a\0b")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a pipe with a name")
def test_a_pipe_and_a_device_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        for read in (read_log, read_tum):
            with pytest.raises(LogError, match="is a pipe or a device, expected a file"):
                read(path)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.0, 0.0, np.inf), "front"])
def test_a_laser_offset_that_is_none(save, run, offset):
    with pytest.raises((InvalidParameterError, InvalidPointsError), match="`laser_offset` must"):
        read_log(save(run), laser_offset=offset)


@pytest.mark.parametrize("parameter", ["topic", "odometry_topic"])
def test_topics_are_for_bags(save, run, parameter):
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


@given(garbage=st.binary(min_size=1, max_size=60), data=st.data())
@settings(deadline=None, max_examples=100)
def test_garbage_loses_no_more_than_its_line(scratch, run, garbage, data):
    good = run.encode()
    position = data.draw(st.integers(1, len(good)))
    scratch.write_bytes(good[:position] + garbage + good[position:])
    assert 4 <= len(read_log(scratch)) <= 5


@given(
    magic=st.sampled_from(
        [
            *(b"", b"\x1f\x8b\x08", b"PK\x03\x04", b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n"),
            *(b"SQLite format 3\0", b"VERTEX_SE2 ", b"FLASER ", b"ROBOTLASER1 ", b"1 2\n"),
        ]
    ),
    garbage=st.binary(max_size=300),
    strict=st.booleans(),
)
@settings(deadline=None, max_examples=250)
def test_garbage_raises_nothing_but_log_errors(scratch, magic, garbage, strict):
    scratch.write_bytes(magic + garbage)
    try:
        log = read_log(scratch, strict=strict, angles=(0.0, 1.0))
    except LogError:
        return
    assert len(log) > 0


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


def test_a_message_stays_short(save, flaser):
    fields = flaser([1.0, 2.0]).split()
    fields[-3:-1] = "9" * 3000, "h" * 3000
    assert len(read_log(save(flaser([1.0] * 2) + " ".join(fields))).skipped[0].reason) <= 180


def test_a_log_holds_one_pose_for_each_scan_and_says_so_in_a_line(save, run):
    scan = Scan.from_points([[1.0, 2.0]])
    with pytest.raises(InvalidPointsError, match=r"`odometry` must have shape \(1, 3\).*\(2, 3\)"):
        Log(scans=(scan,), odometry=np.zeros((2, 3)), name="x", format="points")
    assert repr(read_log(save(run))) == "Log(run: 5 scans, carmen, odometry)"
