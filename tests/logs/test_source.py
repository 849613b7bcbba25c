"""The lines of a file: however it is packed and cut into pieces, and never more than is allowed."""

import gzip
import io
import os
import tracemalloc
import zipfile
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.errors import InvalidParameterError, LogError
from labkit.logs import ReadLimits, read_log, read_tum, stream_log
from labkit.logs import source as source_module
from labkit.logs.lines import DamageReport
from labkit.logs.source import TextSource


def zipped(content):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("run.log", content)
    return buffer.getvalue()


PACKINGS = {
    "plain": bytes,
    "gzip": gzip.compress,
    "a member a byte": lambda data: b"".join(
        gzip.compress(data[k : k + 1]) for k in range(len(data))
    ),
    "padded": lambda data: gzip.compress(data) + 1000 * b"\0",
    "zip": zipped,
}


@pytest.mark.parametrize("packing", PACKINGS)
@given(data=st.lists(st.sampled_from([b"a", b"bc", b"\n", b"\r", b"\r\n", b"\n\n"]), max_size=30))
def test_lines_are_those_of_python_wherever_the_pieces_end(scratch, packing, data):
    content = b"x" + b"".join(data)
    scratch.write_bytes(PACKINGS[packing](content))
    pieces = source_module.PIECE
    source_module.PIECE = 3
    try:
        lines = list(TextSource(scratch).lines())
    finally:
        source_module.PIECE = pieces
    assert [number for number, _ in lines] == list(range(1, len(lines) + 1))
    assert [text for _, text in lines] == content.decode().splitlines()


@pytest.mark.parametrize("ends", ["\n", "\r\n", ""])
def test_a_line_that_is_too_long_is_one_damaged_line(save, flaser, ends):
    good = flaser([1.0, 2.0])
    text = good + "9" * 5000 + ends + (good if ends else "")
    path = save(text)
    log = read_log(path, limits=ReadLimits(max_line_bytes=1000))
    assert len(log) == (2 if ends else 1)
    assert str(log.skipped[0]) == (
        f"{path}:2: a line of more than 1,000 bytes; if it is no damage, raise `max_line_bytes`"
    )
    with pytest.raises(LogError, match=r"run\.log:2: a line of more than 1,000 bytes"):
        read_log(path, limits=ReadLimits(max_line_bytes=1000), strict=True)


@pytest.mark.parametrize("pack", [bytes, gzip.compress, zipped])
def test_a_file_that_is_too_long_is_refused_with_the_way_out(save, run, pack):
    path = save(pack(run.encode()))
    size = len(run.encode())
    assert len(read_log(path, limits=ReadLimits(max_bytes=size))) == 5
    unpacked = "" if pack is bytes else " once unpacked"
    for read in (read_log, stream_log):
        with pytest.raises(LogError) as raised:
            read(path, limits=ReadLimits(max_bytes=size - 1))
        assert str(raised.value) == (
            f"{path}: more than {size - 1:,} bytes{unpacked}; if it is what you expect, raise "
            f"`max_bytes`"
        )


@pytest.mark.parametrize("field", ["max_bytes", "max_line_bytes"])
def test_limits_are_counts(field):
    with pytest.raises(InvalidParameterError, match=f"`{field}` must be a whole number.*got 0"):
        ReadLimits(**{field: 0})


def packed_zeros(size):
    """A gzip stream of zeros, which takes a thousandth of what it unpacks to."""
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    piece = bytes(1 << 20)
    return b"".join(packer.compress(piece) for _ in range(size >> 20)) + packer.flush()


BOMBS = {
    "zeros": lambda: packed_zeros(32 << 20),
    "comments": lambda: gzip.compress((b"# " + 1000 * b"x" + b"\n") * 20_000),
    "members": lambda: 3_000 * gzip.compress(b"# a comment\n", mtime=0),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_small_file_takes_little_memory_whatever_it_unpacks_to(save, bomb):
    path = save(BOMBS[bomb]())
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match=r"unknown format|no line of up to 4,194,304 bytes"):
            read_log(path)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a pipe with a name")
def test_a_pipe_and_a_device_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        for read in (read_log, read_tum):
            with pytest.raises(LogError, match=r"is a pipe or a device, expected a file"):
                read(path)


def test_progress_is_told_to_the_end(save, run):
    told = []
    path = save(run)
    read_log(path, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (path.stat().st_size, path.stat().st_size)


def test_a_packing_that_is_not_known(save):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("run.log", "text")
    with pytest.raises(LogError, match=r"cannot be unpacked: its packing, number 12, is none"):
        read_log(save(buffer.getvalue()))


def test_damage_without_a_report_is_passed_over(save, run):
    source = TextSource(save(gzip.compress(run.encode())[:-4]))
    whole = [text for _, text in source.lines()]
    assert whole == run.splitlines()
    report = DamageReport("run.log", strict=False)
    assert list(source.lines(report))
    assert "the gzip stream ends early" in report.skipped[0].reason
