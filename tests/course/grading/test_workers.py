"""A grader that is killed leaves nothing: no worker, no sandbox, no file of theirs."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from small import HANGS, RIGHT

from labkit.course.grading.sandbox.host import MODES, available_modes

PATIENCE = 60.0  # s, for a machine that has much else to do


def processes():
    """Each process's parent, by number."""
    found = {}
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError, IndexError):
            if folder.name.isdigit():
                state, parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
                if state not in "ZX":
                    found[int(folder.name)] = int(parent)
    return found


def family(pid):
    """A process and all below it."""
    parents = processes()
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("mode", MODES)
def test_a_killed_grader_leaves_nothing(mode, small, tmp_path_factory):
    tmp_path = tmp_path_factory.mktemp("k")  # short: the name of a socket has at most 107 bytes
    if available_modes()[mode]:
        pytest.skip(available_modes()[mode])
    for folder in ("class", "tmp"):
        (tmp_path / folder).mkdir()
    for number in range(8):
        source = HANGS if number % 2 else RIGHT
        (tmp_path / f"class/student{number}.py").write_text(source, encoding="utf-8")
    where = ["--no-isolation"] if mode == "none" else ["--mode", mode]
    command = [sys.executable, "-m", "labkit", "grade", "class", "--assignment", str(small)]
    with subprocess.Popen(
        [*command, "--jobs", "2", "--seconds", "600", *where],
        cwd=tmp_path,
        env=os.environ | {"TMPDIR": str(tmp_path / "tmp")},
        stderr=subprocess.DEVNULL,
    ) as grader:
        verdicts = tmp_path / "grades/verdicts.jsonl"
        until = time.monotonic() + PATIENCE
        while not verdicts.exists() or verdicts.read_bytes().count(b"\n") < 3:
            assert time.monotonic() < until, "nothing was graded"
            time.sleep(0.05)
        left = family(grader.pid)
        assert len(left) > 5
        grader.send_signal(signal.SIGKILL)
    until = time.monotonic() + PATIENCE
    while set(left) & processes().keys() or os.listdir(tmp_path / "tmp"):
        assert time.monotonic() < until, (
            set(left) & processes().keys(),
            os.listdir(tmp_path / "tmp"),
        )
        time.sleep(0.05)
