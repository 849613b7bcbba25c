"""What damaged logs do to their readers: run by hand, not by the tests.

``python tests/logs/fuzz.py [--files 100000] [--seed 0]`` writes good logs of every format (CARMEN,
g2o, tables of points, trajectories, ROS bags, plain and packed), damages a copy in one to six
places (bytes flipped, cut out, repeated; numbers and words put in the place of others) and reads
it by `read_log` or `read_tum`. A file is either refused by a
`LogError` of at most 300 characters, or what it gives is finite and whole. Anything else, a
warning too, stops the run and names the file's number: ``--only NUMBER`` tries that one again.
"""

from __future__ import annotations

import argparse
import gzip
import random
import resource
import shutil
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from test_read_log import zipped
from test_rosbag import Bag

from labkit.errors import LogError
from labkit.logs import read_log, read_tum

LONGEST_MESSAGE = 300  # characters
SLOW = 10.0  # s
NUMBERS = (
    "0", "-0", "-1", "1", "2", "3", "0.5", "180", "181", "1e3", "1e9", "-1e9", "1e308", "1e309",
    "1e-320", "nan", "inf", "-inf", "9" * 30, "1_000", "0x10", "٣", "", "1.2.3", "--1", "8.191",
    "32.767", "81.91", "2147483648", "18446744073709551616", "4294967295",
)  # fmt: skip
WORDS = (
    "FLASER", "ROBOTLASER1", "ODOM", "VERTEX_SE2", "EDGE_SE2", "PARAM", "TRUEPOS", "#", "\n",
    "\r\n", "\0", ",", ";", "\t", "x,y", ",x,y", "x,y,z", "scan,x,y", "timestamp", "é", "\ufeff",
)  # fmt: skip
READERS = {
    "read": lambda path, strict: read_log(path, strict=strict, angles=(-1.5, 1.5)),
    "tum": lambda path, strict: read_tum(path),
}


def good_texts() -> dict[str, str]:
    """A small log of each text format."""
    rng = np.random.default_rng(0)
    ranges = rng.uniform(1.0, 9.0, (8, 12)).round(3)
    poses = np.column_stack([0.3 * np.arange(8), 0.1 * np.arange(8), 0.05 * np.arange(8)])
    carmen, robotlaser, graph = "# a run\nPARAM robot_length 1 host 0\n", "", ""
    for k, (row, pose) in enumerate(zip(ranges, poses.round(4), strict=True)):
        beams, place = " ".join(map(str, row)), " ".join(map(str, pose))
        carmen += f"ODOM {place} 0 0 0 {k} host {k}\n"
        carmen += f"FLASER 12 {beams} {place} {place} {k} host {k}\n"
        laser = f"ROBOTLASER1 0 -1.57 3.14 0.27 50.0 0.1 0 12 {beams} 0 "
        laser += f"{place} {place} 0 0 0 0 0 {k} host {k}\n"
        robotlaser += laser
        graph += f"VERTEX_SE2 {k} {place}\n{laser}"
    graph += "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n"
    points = rng.uniform(-5.0, 5.0, (30, 2)).round(3)
    rows = "".join(f"{x},{y}\n" for x, y in points)
    scans = "".join(f"{n // 10},{x},{y}\n" for n, (x, y) in enumerate(points))
    tum = "# t x y z q\n" + "".join(f"{k}.5 {k} 0.1 0 0 0 0 1\n" for k in range(8))
    return {"carmen": carmen, "robotlaser": robotlaser, "g2o": graph, "tum": tum,
            "rows": rows, "xy": "x,y\n" + rows, "scans": "scan,x,y\n" + scans,
            "ranges": "".join(",".join(map(str, row)) + "\n" for row in ranges)}  # fmt: skip


def good_files(folder: Path) -> dict[str, dict[str, bytes]]:
    """The files of each good log by their names; a ROS 2 bag has two."""
    files = {name: {"run.log": text.encode()} for name, text in good_texts().items()}
    for name in ("carmen", "g2o", "scans"):
        (data,) = files[name].values()
        files[f"{name} in gzip"] = {"run.log.gz": gzip.compress(data, mtime=0)}
        files[f"{name} in zip"] = {"run.zip": zipped({"run.log": data})}
    for ros in (1, 2, "mcap"):
        bag = Bag(folder / f"bag-{ros}", ros)
        for k in range(6):
            bag.odometry(10.0 + k, 0.3 * k, 0.0, 0.05 * k)
            bag.scan(10.2 + k)
        path = bag.close()
        paths = [path] if path.is_file() else sorted(path.iterdir())
        files[f"ros {ros}"] = {one.name: one.read_bytes() for one in paths}
    return files


def damaged(rng: random.Random, data: bytes) -> bytes:
    """The file with one to six wounds; words and numbers are put in where bytes stood."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        start = rng.randrange(len(data) + 1)
        length = rng.choice((0, 1, 1, 2, 4, 8, 40, 400))
        end = min(start + length, len(data))
        wound = rng.choice(("flip", "cut", "end", "repeat", "number", "number", "word", "bytes"))
        if wound == "flip":
            put = bytes(byte ^ (1 << rng.randrange(8)) for byte in data[start:end])
        elif wound == "repeat":
            put = data[start:end] * rng.choice((2, 3, 50))
        elif wound == "number":
            start, end = field_at(data, start)
            put = rng.choice(NUMBERS).encode()
        elif wound == "word":
            put = rng.choice(WORDS).encode()
        else:
            put = rng.randbytes(end - start) if wound == "bytes" else b""
        data = data[:start] + put + (b"" if wound == "end" else data[end:])
    return data


def field_at(data: bytes, start: int) -> tuple[int, int]:
    """Where the field around a byte begins and ends, between blanks and commas."""
    end = start
    while start > 0 and data[start - 1] not in b" ,\n":
        start -= 1
    while end < len(data) and data[end] not in b" ,\n":
        end += 1
    return start, end


def check(outcome: object) -> None:
    """What a reader gives holds numbers only, one pose a scan and beams ahead of the scanner."""
    if isinstance(outcome, np.ndarray):
        assert np.isfinite(outcome).all()
        return
    if isinstance(outcome, tuple):  # a trajectory: stamps and poses
        assert all(np.isfinite(array).all() for array in outcome)
        return
    scans = list(outcome.scans) if hasattr(outcome, "scans") else [outcome]
    assert len(scans) > 0
    for scan in scans:
        assert np.isfinite(scan.points).all()
        assert scan.ranges is None or (scan.ranges[scan.beams] > 0).all()
    for poses in (getattr(outcome, "odometry", None), getattr(outcome, "reference", None)):
        assert poses is None or (poses.shape == (len(scans), 3) and np.isfinite(poses).all())
    for skipped in getattr(outcome, "skipped", ()):
        assert len(skipped.reason) <= LONGEST_MESSAGE, skipped


class Fuzz:
    """Damaged files, one after the other, in one folder."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.seed = seed
        self.folder = folder
        self.good = good_files(folder)
        self.ends: Counter[str] = Counter()
        self.slowest = (0.0, -1)

    def try_one(self, number: int) -> None:
        """Write file `number`, read it, and look at what came of it."""
        rng = random.Random(f"{self.seed} {number}")
        kind = rng.choice(list(self.good))
        files = dict(self.good[kind])
        hurt = rng.choice(list(files))
        files[hurt] = damaged(rng, files[hurt])
        place = self.folder / "damaged"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        for name, data in files.items():
            (place / name).write_bytes(data)
        path = place if len(files) > 1 else place / next(iter(files))
        by = "read"
        if kind == "tum" and rng.random() < 0.5:
            by = "tum"
        start = time.perf_counter()
        try:
            check(READERS[by](path, rng.random() < 0.2))
            refusal = ""
        except LogError as error:
            refusal = str(error).replace(str(path), "")
        seconds = time.perf_counter() - start
        assert len(refusal) <= LONGEST_MESSAGE, refusal
        assert seconds < SLOW, f"{seconds:.1f} s"
        self.ends["refused" if refusal else "read"] += 1
        self.slowest = max(self.slowest, (seconds, number))


def main() -> None:
    """Damage, read, tell."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--files", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="the number of one file")
    args = parser.parse_args()
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as folder:
        fuzz = Fuzz(args.seed, Path(folder))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for number in range(args.files) if args.only is None else (args.only,):
            try:
                fuzz.try_one(number)
            except BaseException:
                print(f"file {number}:", flush=True)
                raise
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    seconds, number = fuzz.slowest
    print(f"{sum(fuzz.ends.values())} files: {dict(fuzz.ends)}; slowest {seconds:.2f} s "
          f"(file {number}); memory grew by {grown / 1024:.0f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
