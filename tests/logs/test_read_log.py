import gzip
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labkit.errors import InvalidParameterError, InvalidPointsError, LogError
from labkit.logs import Log, read_log
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
    "gzip": lambda text: gzip.compress(text.encode()),
    "two gzip members": lambda text: (
        gzip.compress(text[:100].encode()) + gzip.compress(text[100:].encode())
    ),
    "zip": lambda text: zipped({"run.log": text}),
    "stored zip": lambda text: zipped({"run.log": text}, zipfile.ZIP_STORED),
    "zip from a Mac": lambda text: zipped({"a/": "", "__MACOSX/._run": "x", "a/run.log": text}),
}


@pytest.mark.parametrize("packing", PACKINGS)
@pytest.mark.parametrize("name", ["run.log", "run.gz", "run.zip", "run.csv", "run"])
def test_packing_and_format_are_told_from_the_content(save, run, packing, name):
    log = read_log(save(PACKINGS[packing](run), name), strict=True)
    assert (len(log), log.format, log.name) == (5, "carmen", "run")


@pytest.mark.parametrize(
    ("name", "expected"),
    [("intel.log.gz", "intel"), ("a.b.g2o.zip", "a.b"), (".log", ".log"), ("run-2.1", "run-2.1")],
)
def test_the_name_of_a_run_goes_without_suffixes(save, run, name, expected):
    assert read_log(save(run, name)).name == expected


UNREADABLE = [
    (b"", r"f: the file is empty"),
    (b" \n\n", r"f: the file is empty"),
    (gzip.compress(b"", mtime=0), r"f: the file is empty"),
    (
        gzip.compress(b"", mtime=0)[:8],
        r"f: the file is empty \(the gzip stream ends early, after 8 bytes\)",
    ),
    (b"PK\x03\x04", r"f: the file is empty \(the zip archive ends within its first header\)"),
    (b"\x7fELF\0\0\0", r"f: unknown format, the file begins with binary data; labkit reads CARMEN"),
    (b"\x01" * 50, r"f: unknown format, the file begins with binary data; labkit reads CARMEN"),
    (b"Dear reader,\n", r"f: unknown format, the file begins with 'Dear reader,'; labkit reads"),
    (zipped({}), r"f: a zip archive must hold exactly one log, got 0 \(none\)"),
    (zipped({"a": "x", "b": "y"}), r"exactly one log, got 2 \(a, b\); unpack it and name one file"),
]


@pytest.mark.parametrize(("content", "message"), UNREADABLE)
def test_a_file_that_is_no_log(save, content, message):
    with pytest.raises(LogError, match=message):
        read_log(save(content, "f"))


def test_an_archive_whose_directory_points_before_its_beginning(save, run):
    packed = bytearray(zipped({"run.log": run}))
    packed[-6] += 1  # where the directory begins, according to its last record
    log = read_log(save(bytes(packed)))
    assert len(log) == 5
    assert "the zip archive is damaged" in log.skipped[0].reason


def test_an_encrypted_archive(save, run):
    packed = bytearray(zipped({"run.log": run}))
    packed[6] |= 1
    packed[packed.index(b"PK\x01\x02") + 8] |= 1
    with pytest.raises(LogError, match=r"the zip archive cannot be unpacked: .*encrypted"):
        read_log(save(bytes(packed)))


def test_paths_with_nothing_to_read(tmp_path, save, monkeypatch):
    with pytest.raises(LogError, match=r"gone\.log: no such file"):
        read_log(tmp_path / "gone.log")
    with pytest.raises(LogError, match="is a directory, expected a file"):
        read_log(tmp_path)
    with pytest.raises(LogError, match="cannot be read: Not a directory"):
        read_log(save("x") / "inside.log")
    with pytest.raises(LogError, match=r"cannot be read: .*null"):
        read_log("a\0b")

    def refuse(path, mode):
        raise PermissionError(13, "Permission denied")

    path = save("x")
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(LogError, match=r"run\.log: no permission to read it"):
        read_log(path)


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.0, 0.0, np.inf), "front"])
def test_a_laser_offset_that_is_none(save, run, offset):
    with pytest.raises((InvalidParameterError, InvalidPointsError), match="`laser_offset` must"):
        read_log(save(run), laser_offset=offset)


@pytest.mark.parametrize("parameter", ["topic", "odometry_topic"])
@pytest.mark.parametrize("text", [None, "VERTEX_SE2 0 0 0 0\n", "1,2\n"])
def test_topics_are_for_bags(save, run, text, parameter):
    path = save(run if text is None else text)
    message = rf"run\.log: `{parameter}` is '/scan', but the file is no ROS bag.*leave it out"
    with pytest.raises(LogError, match=message):
        read_log(path, **{parameter: "/scan"})
    with pytest.raises(LogError, match="no such file"):
        read_log("gone.bag", **{parameter: "/scan"})


@pytest.mark.parametrize("packing", ["gzip", "zip"])
def test_a_damaged_stream_keeps_what_came_before_it(save, flaser, packing):
    rng = np.random.default_rng(2)
    text = "".join(flaser(rng.uniform(1.0, 9.0, 40).round(6)) for _ in range(40))
    packed = PACKINGS[packing](text)
    flipped = bytearray(packed)
    flipped[len(packed) * 3 // 4] ^= 0xFF
    for damaged in (packed[: len(packed) // 2], bytes(flipped)):
        path = save(damaged)
        log = read_log(path)
        assert 15 < len(log) <= 40
        assert any(f"the {packing}" in skipped.reason for skipped in log.skipped)
        with pytest.raises(LogError, match=rf"run\.log:\d+: the {packing} (stream|archive) "):
            read_log(path, strict=True)


@given(data=st.data())
@settings(deadline=None, max_examples=150)
def test_no_cut_loses_an_earlier_scan(scratch, run, data):
    packing = data.draw(st.sampled_from(["plain", "gzip", "zip"]))
    packed = PACKINGS[packing](run)
    cut = data.draw(st.integers(0, len(packed)))
    scratch.write_bytes(packed[:cut])
    whole = run.encode()[:cut].count(b" host 2.0\n") if packing == "plain" else 0
    try:
        scans = read_log(scratch).scans
    except LogError:
        scans = ()
    assert len(scans) >= whole
    assert [scan.stamp for scan in scans] == [100.0 + k for k in range(len(scans))]
    assert [scan.ranges[0] for scan in scans] == [1.0 + k for k in range(len(scans))]


@given(garbage=st.binary(min_size=1, max_size=60), data=st.data())
@settings(deadline=None, max_examples=150)
def test_garbage_at_the_end_loses_no_scan(scratch, run, garbage, data):
    good = run.encode()
    scratch.write_bytes(good + garbage)
    assert len(read_log(scratch)) == 5
    position = data.draw(st.integers(1, len(good)))
    scratch.write_bytes(good[:position] + garbage + good[position:])
    assert 5 - 1 <= len(read_log(scratch)) <= 5


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
@settings(deadline=None, max_examples=400)
def test_garbage_raises_nothing_but_log_errors(scratch, magic, garbage, strict):
    scratch.write_bytes(magic + garbage)
    try:
        log = read_log(scratch, strict=strict)
    except LogError:
        return
    assert len(log) > 0


def test_a_log_holds_one_pose_for_each_scan():
    scan = Scan.from_points([[1.0, 2.0]])
    with pytest.raises(InvalidPointsError, match=r"`odometry` must have shape \(1, 3\).*\(2, 3\)"):
        Log(scans=(scan,), odometry=np.zeros((2, 3)), name="x", format="points")
