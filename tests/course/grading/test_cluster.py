"""A Dask cluster grades as one machine does, also when it loses a worker on the way."""

import csv
import os
import signal
import subprocess
import sys
import time
from collections import Counter

import pytest
from small import hand_in

from labkit.course.grading.sandbox.host import available_modes

pytest.importorskip("distributed", reason="grading on a cluster needs: pip install distributed")
SAFE = any(not why for mode, why in available_modes().items() if mode != "none")
WHERE = [] if SAFE else ["--no-isolation"]


@pytest.fixture
def scheduler():
    """The address of a scheduler with no workers yet."""
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0"]
    command += ["--host", "127.0.0.1", "--no-dashboard"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            for line in process.stderr:
                if "Scheduler at:" in line:
                    yield line.split("Scheduler at:")[1].strip()
                    break
        finally:
            process.kill()


@pytest.fixture
def workers(scheduler, tmp_path):
    """Two workers of one thread each, without nannies: what dies stays dead."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", scheduler]
    command += ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    started = [
        subprocess.Popen(
            [*command, "--local-directory", str(tmp_path / name)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        for name in ("one", "two")
    ]
    yield started
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.mark.slow
def test_two_hundred_submissions_and_a_worker_that_dies(small, scheduler, workers, tmp_path):
    """Takes some twenty seconds; buys that no verdict is lost, doubled or blamed on others."""
    expected = hand_in(tmp_path / "class", 200)
    verdicts = tmp_path / "grades/verdicts.jsonl"
    command = [sys.executable, "-m", "labkit", "grade", str(tmp_path / "class"), "--no-html"]
    command += ["--assignment", str(small), "--out", str(tmp_path / "grades"), *WHERE]
    with subprocess.Popen(
        [*command, "--cluster", scheduler],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as grader:
        deadline = time.monotonic() + 90
        while count(verdicts) < 30 and time.monotonic() < deadline:
            time.sleep(0.02)
        os.killpg(workers[0].pid, signal.SIGKILL)
        out, errors = grader.communicate(timeout=120)
    assert grader.returncode == 0, errors
    assert "200 of 200 submissions graded" in out
    with (tmp_path / "grades/scores.csv").open(encoding="utf-8") as file:
        assert {row["student"]: float(row["score"]) for row in csv.DictReader(file)} == expected
    lines = verdicts.read_text(encoding="ascii").splitlines()[1:]
    assert set(Counter(line.split('"')[3] for line in lines).values()) == {1}


def count(path):
    return path.read_bytes().count(b"\n") if path.exists() else 0
