"""Law 1: no clock decides a mark."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from labkit.grading.box.outside import Box, Wall
from labkit.grading.box.watch import MachineError
from labkit.grading.classroom import rounds
from labkit.grading.questions import read_assignment
from tests.grading.failing import ASSIGNMENT
from tests.grading.notebooks import answered
from tests.grading.small import HANGS, SQUARED, hand_in, scores

WAITS = "import threading\ndef double(x):\n    threading.Event().wait(99)\nnegate = double\n"
DRAWS = "import random\nimport numpy as np\nFIRST = np.random.rand(), random.random()\n"
DRAWS += "def double(x):\n    return FIRST[0] + np.random.rand()\n"
DRAWS += "def negate(x):\n    return FIRST[1] + random.random()\n"
WORKS = "def double(x):\n    return sum(2 * x for _ in range(300_000)) / 300_000\nnegate = double\n"


def test_a_verdict_is_the_same_beside_a_load(graded, small):
    """Law 1, on what never ends, what waits, and what takes some of its time."""
    assignment = read_assignment(small)
    hands_in = [text.encode() for text in (SQUARED, HANGS, WAITS, WORKS, DRAWS)]

    def verdicts():
        found = [graded({"a.py": text}, assignment, seconds=0.5) for text in hands_in]
        return [replace(one, seconds=0.0) for one in found]

    alone, computes = verdicts(), [sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(computes) for _ in range(4 * (os.cpu_count() or 1))]
    try:
        assert verdicts() == alone
    finally:
        for one in busy:
            one.kill()
            one.wait()


SLOW = """import time
def double(x):
    end = time.process_time() + {seconds}
    while x > 2.5 and time.process_time() < end:
        pass
    return 2 * x
def negate(x):
    return -x
"""


def test_what_is_right_so_far_and_slow_has_more_time(graded, small):
    """Law 1: visible cases pass, and a hidden one takes three times as long as a call may."""
    source = SLOW.format(seconds=1.5)

    verdict = graded({"a.py": source.encode()}, read_assignment(small), seconds=0.5)

    assert verdict.score == 5.0, verdict.questions


def test_what_takes_too_long_is_told_so_and_not_called_wrong(graded, small):
    """Law 1."""
    source = SLOW.format(seconds=99.0)

    double, negate = graded(
        {"a.py": source.encode()}, read_assignment(small), seconds=0.5
    ).questions

    slow = [case for case in double.cases if not case.passed]
    assert {case.status for case in slow} == {"too long"}
    is_first = ["it took too long" in case.reason for case in slow]
    assert is_first == [True, *[False] * len(slow[1:])]
    assert all("it was not tried" in case.reason for case in slow[1:])
    assert negate.passed


LOOPS = {  # each answer right, and as slow as plain loops are
    "nearest_neighbors": """def nearest_neighbors(source, target):
    indices, distances = [], []
    for p in source:
        gaps = []
        for q in target:
            gaps.append(np.linalg.norm(np.array(p) - np.array(q)))
        indices.append(int(np.argmin(gaps)))
        distances.append(min(gaps))
    return np.array(indices), np.array(distances)
""",
    "icp": """def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T = T_init
    for _ in range(max_iterations):
        T = icp_step(source, target, T, max_distance, overlap_ratio, delta)
    return T
""",
}  # fmt: skip


def test_a_program_of_plain_loops_earns_all_points_each_time(graded):
    """Law 1, idle and beside a load."""
    files = {"a.ipynb": answered(LOOPS, closing=False)}

    with ThreadPoolExecutor(8) as executor:
        verdicts = list(executor.map(lambda _: graded(files, ASSIGNMENT), range(8)))

    assert [one.score for one in verdicts] == [100.0] * 8


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows knows no SIGSTOP")
def test_a_grader_that_is_stopped_takes_no_points(options, tmp_path):
    """Law 1: stopped twice, while boxes are at work, for longer than a box may sleep."""
    hand_in(tmp_path / "class", 0)
    for number in range(24):
        (tmp_path / "class" / f"s{number}.py").write_text(SLOW.format(seconds=0.4))
    start = (
        f"import sys\nfrom labkit.cli import main\n"
        f"sys.modules['labkit.cli.main'].FOLDER = {options[2] + '.cases'!r}\n"
        f"main({[*options, 'class']})"
    )

    with subprocess.Popen([sys.executable, "-c", start], cwd=tmp_path) as run:
        for count in (2, 12):
            while len(list((tmp_path / "grades").glob("verdicts/*"))) < count:
                assert run.poll() is None
                time.sleep(0.02)
            run.send_signal(signal.SIGSTOP)
            time.sleep(8.0)
            run.send_signal(signal.SIGCONT)

    assert scores(tmp_path / "grades") == {f"s{number}": 5.0 for number in range(24)}


def test_a_machine_s_failure_is_tried_again_told_and_not_stored(
    grade, tmp_path, monkeypatch, capsys
):
    """Law 1."""
    hand_in(tmp_path / "class", 2)
    tries = []

    def busy(box):
        tries.append(box)
        raise MachineError("this machine was too busy")

    monkeypatch.setattr(Box, "receive", busy)
    monkeypatch.setattr("labkit.grading.command.open_wall", lambda *_, **__: Wall("none"))
    assert grade("class") == 1
    assert len(tries) == 4
    says = "student00001 was not graded: MachineError: the box did not start: this"
    assert says in capsys.readouterr().err
    assert not list((tmp_path / "grades/verdicts").iterdir())


def test_whom_a_quiet_machine_grades_in_the_second_round_is_no_failure(
    grade, tmp_path, monkeypatch, capsys
):
    """Law 1."""
    expected = hand_in(tmp_path / "class", 2)
    tries = []

    def make_record(submission, *arguments, real=rounds.make_record):
        tries.append(submission)
        if len(tries) <= len(expected):
            raise MachineError("this machine was too busy")
        return real(submission, *arguments)

    monkeypatch.setattr(rounds, "make_record", make_record)

    assert grade("class") == 0
    assert scores() == expected
    assert "was not graded" not in capsys.readouterr().err
