"""Many submissions in one go: memory, and what a SIGKILL halfway changes. (Nothing may.)

``python tests/bench/graders/ten_thousand.py`` grades a class twice with ``labkit grade``:
undisturbed, while the peak memory of each process is read; then killed with its whole
process group when half of the verdicts are stored, and run again. Linux.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "tests/course/grading"), str(ROOT / "tests/course/authoring")]

from small import hand_in, write_assignment  # noqa: E402

from labkit.cli.text import table  # noqa: E402
from labkit.course.grading.assignment import FOLDER  # noqa: E402
from submissions import lab_answers  # noqa: E402

LOOK = 0.25  # s between two looks at the processes
LEAVE = 10.0  # s that what was killed may take to be gone
KINDS = ("parent", "server", "worker", "sandbox")  # each starts the next one


@dataclass(kw_only=True)
class Watched:
    """A run of ``labkit grade``, its processes and what it has stored so far."""

    command: list[str]
    store: Path
    process: subprocess.Popen[bytes] = field(init=False)
    peaks: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    seen: set[tuple[int, str]] = field(default_factory=set)
    stored: int = 0
    read: int = 0

    def start(self) -> None:
        """Start it as the leader of a process group."""
        self.process = subprocess.Popen(
            self.command, start_new_session=True, stdout=subprocess.DEVNULL
        )

    def look(self) -> None:
        """Count the verdicts, and read each process's peak memory [kB]."""
        time.sleep(LOOK)
        if self.store.exists():
            with self.store.open("rb") as file:
                file.seek(self.read)
                for line in file:
                    self.read += len(line)
                    self.stored += line.endswith(b"\n")
        for pid, kind in _family(self.process.pid):
            self.seen.add((pid, _born(pid)))
            self.peaks[kind] = max(self.peaks[kind], _peak(pid))

    def survivors(self) -> list[int]:
        """Processes of the run that are still there some time after its end."""
        end = time.monotonic() + LEAVE
        while time.monotonic() < end and any(_born(pid) == born for pid, born in self.seen):
            time.sleep(LOOK)
        return [pid for pid, born in self.seen if born and _born(pid) == born]


def main() -> int:
    """Grade the class undisturbed, then killed and resumed; compare, and print the figures."""
    args = _parse()
    with tempfile.TemporaryDirectory(prefix="graders-") as name:
        folder = Path(name)
        assignment = _make_class(folder, args)
        results: dict[str, Any] = {"count": args.count, "assignment": args.assignment}
        whole = _watched(folder, assignment, "whole", args)
        results |= _undisturbed(whole, args)
        results |= _killed(folder, assignment, args)
        same = _verdicts(whole.store) == _verdicts(folder / "killed/verdicts.jsonl")
        results["same verdicts"] = same
    print(json.dumps(results, indent=1))
    print(_memory_table(results["peak_kB"]))
    return 0 if same and not results["survivors"] else 1


def _make_class(folder: Path, args: argparse.Namespace) -> Path:
    """Write the submissions; the folder of the assignment."""
    if args.assignment == "small":
        hand_in(folder / "class", args.count)
        return write_assignment(folder / "assignment")
    (folder / "class").mkdir()
    for number, answers in enumerate(islice(lab_answers(), args.count)):
        parts = [answers.get("", ""), *(answers[name] for name in answers if name)]
        path = folder / f"class/student{number:05}.py"
        path.write_text("\n\n".join(["import numpy as np", *parts]) + "\n", encoding="utf-8")
    return FOLDER


def _watched(folder: Path, assignment: Path, out: str, args: argparse.Namespace) -> Watched:
    command = [sys.executable, "-m", "labkit", "grade", str(folder / "class")]
    command += [] if args.pages else ["--no-html"]
    command += ["--assignment", str(assignment), "--jobs", str(args.jobs)]
    command += ["--out", str(folder / out)]
    return Watched(command=command, store=folder / out / "verdicts.jsonl")


def _undisturbed(run: Watched, args: argparse.Namespace) -> dict[str, Any]:
    """Grade all; memory when the first tenth was stored, and at the end."""
    early: dict[str, int] = {}
    start = time.perf_counter()
    run.start()
    while run.process.poll() is None:
        run.look()
        if not early and run.stored > args.count // 10:
            early = dict(run.peaks)
    seconds = time.perf_counter() - start
    if run.process.returncode:
        sys.exit(f"labkit grade ended with status {run.process.returncode}")
    peaks = {args.count // 10: early, args.count: run.peaks}
    return {"seconds": round(seconds, 1), "ms_each": 1e3 * seconds / args.count, "peak_kB": peaks}


def _killed(folder: Path, assignment: Path, args: argparse.Namespace) -> dict[str, Any]:
    """Kill the run halfway; run it again to its end."""
    first = _watched(folder, assignment, "killed", args)
    first.start()
    while first.process.poll() is None and first.stored <= args.count // 2:
        first.look()
    os.killpg(first.process.pid, signal.SIGKILL)
    first.process.wait()
    survivors = first.survivors()
    stored = len(_verdicts(first.store))
    start = time.perf_counter()
    again = subprocess.run(first.command, check=True, capture_output=True, text=True)
    return {
        "stored when killed": stored,
        "survivors": survivors,
        "resumed_seconds": round(time.perf_counter() - start, 1),
        "resumed": again.stdout.strip().splitlines()[-1],
    }


def _verdicts(store: Path) -> dict[str, Any]:
    """The stored verdicts but for `seconds`; no student may be there twice."""
    verdicts: dict[str, Any] = {}
    with store.open(encoding="utf-8") as file:
        for line in file:
            if not line.endswith("\n"):
                break  # cut off by the kill
            entry = json.loads(line)
            if "student" in entry:
                assert entry["student"] not in verdicts
                entry["verdict"].pop("seconds")
                verdicts[entry["student"]] = entry
    return verdicts


def _family(parent: int) -> list[tuple[int, str]]:
    """The process, the one that it has workers from, these, and everything below them."""
    family, generation, depth = [(parent, KINDS[0])], [parent], 0
    while generation:
        generation = [child for pid in generation for child in _children(pid)]
        depth = min(depth + 1, len(KINDS) - 1)
        family += [(pid, KINDS[depth]) for pid in generation]
    return family


def _children(pid: int) -> list[int]:
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        return [int(child) for task in tasks for child in (task / "children").read_text().split()]
    except OSError:
        return []


def _peak(pid: int) -> int:
    """The most memory that the process ever held [kB]; 0 where it is gone."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    return int(status.partition("VmHWM:")[2].split()[0]) if "VmHWM:" in status else 0


def _born(pid: int) -> str:
    """When the process was started, so that another one with its number is not taken for it."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return ""
    return "" if fields[0] == "Z" else fields[19]


def _memory_table(peaks: dict[int, dict[str, int]]) -> str:
    rows = [
        [f"{count:,}", *(f"{one[kind] / 1024:.1f}" for kind in KINDS)]
        for count, one in peaks.items()
    ]
    return table(["peak memory [MB] at", *KINDS], rows)


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000, metavar="N")
    parser.add_argument("--assignment", choices=("small", "lab"), default="small")
    parser.add_argument("--pages", action="store_true", help="write the HTML pages, too")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1), metavar="N")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
