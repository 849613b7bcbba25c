"""The law of doors, of whole files: each reader × each trouble that a file can meet on its way."""

import bz2
import codecs
import gzip
import io
import json
import lzma
import sys
import tracemalloc
from contextlib import suppress
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.logs import read_log
from labkit.support.errors import LogError
from tests.logs.test_read_log import zipped

K, B = 6, 12
RANGES = np.random.default_rng(1).uniform(1.0, 4.0, (K, B)).round(3)
ANGLES = np.linspace(-1.0, 1.0, B)
STAMPS = 100.0 + 0.5 * np.arange(K)


@pytest.fixture(scope="module")
def text_of(flaser, robotlaser):
    """A function that writes a log of each text format with the clock of the caller."""

    def write(kind, stamps=STAMPS):
        rows = list(zip(stamps.tolist(), RANGES.tolist(), strict=True))
        beams = ",".join(f"r{b}" for b in range(B))
        if kind == "carmen":
            return "".join(flaser(row, ipc=t) for t, row in rows)
        if kind == "g2o":
            lines = (robotlaser(row, stamp=t) for t, row in rows)
            return "".join(f"VERTEX_SE2 {k} {k} 0 0\n{line}" for k, line in enumerate(lines))
        if kind == "ranges":
            body = "".join(f"{t},{','.join(map(str, row))}\n" for t, row in rows)
            return f"stamp,{beams}\n{body}"
        if kind == "json":
            lines = (
                {"stamp": t, "angle_min": -1.0, "angle_max": 1.0, "ranges": r} for t, r in rows
            )
            return "".join(json.dumps(line) + "\n" for line in lines)
        if kind == "laser scan":
            body = "".join(f"{t},-1.0,{2 / (B - 1)},{','.join(map(str, row))}\n" for t, row in rows)
            return f"stamp,angle_min,angle_increment,{beams}\n{body}"
        x = "x,y" if kind == "points" else "angle,range"
        places = (
            zip(row * np.cos(ANGLES), row * np.sin(ANGLES), strict=True)
            if kind == "points"
            else zip(ANGLES, row, strict=True)
            for _, row in rows
        )
        lines = (
            f"{k},{t},{a},{b}\n"
            for k, ((t, _), pairs) in enumerate(zip(rows, places, strict=True))
            for a, b in pairs
        )
        return f"scan,stamp,{x}\n{''.join(lines)}"

    return write


KINDS = ["carmen", "g2o", "json", "ranges", "laser scan", "polar", "points"]
OPTIONS = {"ranges": {"angles": (-1.0, 1.0)}}
PACKINGS = {
    "mark of UTF-8": lambda text: codecs.BOM_UTF8 + text.encode(),
    "UTF-16": lambda text: text.encode("utf-16"),
    "lines of Windows": lambda text: text.replace("\n", "\r\n").encode(),
    "no end of the last line": lambda text: text.rstrip("\n").encode(),
    "blank lines": lambda text: ("\n\n" + text.replace("\n", "\n\n")).encode(),
    "gzip": lambda text: gzip.compress(text.encode()),
    "bzip2": lambda text: bz2.compress(text.encode()),
    "xz": lambda text: lzma.compress(text.encode()),
    "zip": lambda text: zipped({"run": text}),
    "UTF-16 in gzip": lambda text: gzip.compress(text.encode("utf-16")),
}


def scans_of(path, kind, **options):
    log = read_log(path, **OPTIONS.get(kind, {}), **options)
    return [scan.points.tolist() for scan in log.scans], log


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("packing", PACKINGS)
def test_packing_and_letters_change_nothing(save, text_of, kind, packing):
    scans, log = scans_of(save(PACKINGS[packing](text_of(kind))), kind, strict=True)
    plain, _ = scans_of(save(text_of(kind)), kind, strict=True)
    assert scans == plain
    assert log.stamps.tolist() == STAMPS.tolist()


@given(kind=st.sampled_from(KINDS), share=st.floats(0.0, 1.0), put=st.sampled_from([b"", b"\0"]))
def test_a_file_that_is_cut_or_holds_a_nul_gives_right_scans_or_is_refused(
    scratch, text_of, kind, share, put
):
    """All scans but the last are those of the whole file, or nothing is read."""
    data = text_of(kind).encode()
    scratch.write_bytes(data)
    whole, _ = scans_of(scratch, kind)
    scratch.write_bytes(data[: int(share * len(data))] + put)
    scans = []
    with suppress(LogError):
        scans, _ = scans_of(scratch, kind)
    assert scans[:-1] == whole[: max(len(scans) - 1, 0)]


@given(kind=st.sampled_from(KINDS), swaps=st.lists(st.integers(1, K - 1), min_size=1, max_size=3))
def test_a_clock_that_stands_or_jumps_is_told_and_costs_no_scan(scratch, text_of, kind, swaps):
    stamps = STAMPS.copy()
    for k in swaps:
        stamps[k] = stamps[k - 1] - 0.25 * (k % 2)
    scratch.write_text(text_of(kind, stamps))
    scans, log = scans_of(scratch, kind)
    assert (len(scans), log.stamps.tolist()) == (K, stamps.tolist())
    late = np.count_nonzero(np.diff(stamps) <= 0.0)
    assert f"stands still or runs backwards {late} times" in log.remarks[0]


@pytest.mark.parametrize("clock", ["stamp_ms", "time", "stamps", "time_stamps", None])
@pytest.mark.parametrize("archive", [True, False])
def test_arrays_of_numpy_are_read_by_their_names(save, clock, archive):
    file, unit = io.BytesIO(), 1e3 if clock == "stamp_ms" else 1.0
    arrays = {"ranges": RANGES} | ({clock: unit * STAMPS} if clock else {})
    if archive:
        np.savez(file, angles_deg=np.degrees(ANGLES), **arrays)
    else:
        np.save(file, RANGES)
    path = save(file.getvalue(), "sweeps")
    log = read_log(path, strict=True, **({} if archive else {"angles": (-1.0, 1.0)}))
    points = RANGES[..., None] * np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
    np.testing.assert_allclose([scan.points for scan in log.scans], points)
    expected = STAMPS if clock and archive else np.full(K, np.nan)
    np.testing.assert_allclose(log.stamps, expected)


def test_arrays_of_a_laser_scan_are_read_and_others_are_named(save):
    file = io.BytesIO()
    declared = {"angle_min": -1.0, "angle_increment": 2.0 / (B - 1), "range_max": np.full(K, 3.0)}
    np.savez(file, ranges=RANGES, poses=np.zeros((K, 3)), intensities=RANGES, **declared)

    log = read_log(save(file.getvalue(), "sweeps"))

    np.testing.assert_allclose(log.scans[0].angles, ANGLES)
    assert all((scan.ranges[scan.beams] < 3.0).all() for scan in log.scans)
    assert log.remarks == ("not read: 'poses' (array (6, 3))",)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"poses": RANGES, "b": RANGES}, "no array `ranges` among poses, b"),
        ({"ranges": RANGES[:, :2]}, r"has shape \(6, 2\), expected ranges, one scan of at least 4"),
        ({"ranges": RANGES}, "6 rows of 12 numbers; name the first and the last beam's"),
        (
            {"ranges": RANGES, "angles": ANGLES[1:]},
            r"`angles` must have shape \(12,\)",
        ),
        ({"ranges": RANGES, "angles": 90 * ANGLES}, "`angles` must be radians within one turn"),
        ({"ranges": np.array([None])}, "cannot be read: Object arrays cannot be loaded"),
    ],
)
def test_arrays_that_are_no_log_are_refused_by_their_names(save, arrays, message):
    file = io.BytesIO()
    np.savez(file, **arrays)
    with pytest.raises(LogError, match=f"sweeps: .*{message}"):
        read_log(save(file.getvalue(), "sweeps"))


@pytest.mark.parametrize("part", [(0, 2), (2, 3), (5, 9)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_part_is_that_part_and_no_line_behind_it_is_read(save, text_of, kind, part, monkeypatch):
    start, count = part
    path = save(text_of(kind))
    whole, _ = scans_of(path, kind)
    monkeypatch.setattr(sys.modules["labkit.logs.reader"], "HEAD_LINES", 3)
    read = []
    progress = partial(keep_what_is_read, read)
    scans, _ = scans_of(path, kind, start=start, scans=count, progress=progress)
    assert scans == whole[start : start + count]
    if kind in {"carmen", "g2o"}:
        assert len(read) <= max(3, (start + count) * (2 if kind == "g2o" else 1))


def keep_what_is_read(read, rows):
    for row in rows:
        read.append(row)
        yield row


@pytest.mark.parametrize("kind", ["ranges", "laser scan", "polar", "points"])
def test_a_longer_log_takes_at_most_four_times_the_memory_of_what_its_file_grows_by(save, kind):
    """The law of memory, at its peak: whatever the table, also with two decimals."""
    shape = (1400, 60) if kind in {"ranges", "laser scan"} else (40, 360)
    rows = np.random.default_rng(2).uniform(1.0, 4.0, shape).round(2)
    short, long = (table_of(kind, rows[: len(rows) * part // 4]) for part in (3, 4))

    peak_memory(save(short), kind)  # with what is imported and cached

    growth = peak_memory(save(long), kind) - peak_memory(save(short), kind)

    assert growth < 4 * (len(long) - len(short))


def peak_memory(path, kind):
    """Bytes that reading takes at its peak."""
    tracemalloc.start()
    read_log(path, **OPTIONS.get(kind, {}))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


def table_of(kind, rows):
    """A table of this kind, with two decimals."""
    angles = np.linspace(-1.0, 1.0, rows.shape[1])
    if kind in {"ranges", "laser scan"}:
        titles = ",".join(f"r{b}" for b in range(rows.shape[1]))
        told = ("angle_min,angle_max,", "-1,1,") if kind == "laser scan" else ("", "")
        body = "".join(f"{told[1]}{','.join(map(str, row))}\n" for row in rows.tolist())
        return f"{told[0]}{titles}\n{body}"
    x, y = (angles, rows) if kind == "polar" else (rows * np.cos(angles), rows * np.sin(angles))
    pairs = np.stack(np.broadcast_arrays(x, y), axis=-1)
    lines = (f"{k},{a:.2f},{b:.2f}\n" for k, scan in enumerate(pairs) for a, b in scan.tolist())
    return f"scan,{'angle,range' if kind == 'polar' else 'x,y'}\n{''.join(lines)}"
