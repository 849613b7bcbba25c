"""How long a class takes, how much hostile submissions slow it down, and nbgrader on the same.

``python tests/bench/graders/run.py --students 300 --hostile 20`` grades a class with and without
hostile files; ``--nbgrader 24`` grades as many notebooks in turn with labkit and nbgrader.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from itertools import islice
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path.append(str(ROOT))

from labkit.course.authoring.write import notebook_text  # noqa: E402
from submissions import answered, lab_answers  # noqa: E402

NBGRADER = ROOT / ".venv-graders/bin/python"
HOSTILE = (
    "while True:\n    pass",
    "import threading\nthreading.Event().wait(1e6)",
    "import os\nos._exit(0)",
    "x = 10 ** 10 ** 9",
    "x = ['a' * 2 ** 28 + str(k) for k in range(99)]",
    "def rotation(theta):\n    while True:\n        pass",
    "from threading import Event\nrotation = wrap = align = icp = lambda *a: Event().wait(1e6)",
    "while True:\n    try:\n        while True: pass\n    except BaseException: pass",
    "import threading\nfor k in range(9999): threading.Thread(target=input).start()",
    "open('/box/x', 'wb').write(b'x' * 2 ** 40)",
)


def write_class(folder: Path, students: int, hostile: int) -> None:
    """A class of notebooks: right ones, known mistakes, errors; the last ones are hostile."""
    handed_out = notebook_text()
    for number, answers in enumerate(islice(lab_answers(), students)):
        notebook = json.loads(answered(handed_out, answers))
        if number >= students - hostile:
            source = HOSTILE[number % len(HOSTILE)]
            notebook["cells"].append({"cell_type": "code", "source": source, "metadata": {}})
        path = folder / f"student{number:03}/lab1/assignment.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(notebook), encoding="utf-8")


def grade(folder: Path) -> float:
    """The seconds that `labkit grade` takes for a folder ``submitted``."""
    shutil.rmtree(folder / "grades", ignore_errors=True)
    command = [sys.executable, "-m", "labkit", "grade", "submitted"]
    return timed(command, folder, os.environ)


def timed(command: list[str], folder: Path, environment: Mapping[str, str]) -> float:
    """The seconds that a command takes."""
    start = time.perf_counter()
    subprocess.run(
        command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    return time.perf_counter() - start


def against_nbgrader(folder: Path, students: int, rounds: int) -> None:
    """Print how long both take on the same notebooks, in turn."""
    source = folder / "source/lab1/assignment.ipynb"
    source.parent.mkdir(parents=True)
    source.write_text(notebook_text(solutions=True), encoding="utf-8")
    paths = f"{NBGRADER.parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": paths}
    made = subprocess.run(
        [NBGRADER, "-m", "nbgrader", "generate_assignment", "lab1", "--create", "--force"],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if made.returncode:
        sys.exit(made.stderr)
    write_class(folder / "submitted", students, 0)
    command = [str(NBGRADER), "-m", "nbgrader", "autograde", "lab1", "--create", "--force"]
    for _ in range(rounds):
        theirs = timed(command, folder, environment)
        ours = grade(folder)
        print(f"{students} notebooks: labkit {ours:.1f} s, nbgrader {theirs:.1f} s", end="")
        print(f", ratio {theirs / ours:.1f}", flush=True)


def main() -> None:
    """Measure what the options ask for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--students", type=int, default=300, metavar="N")
    parser.add_argument("--hostile", type=int, default=20, metavar="N")
    parser.add_argument("--nbgrader", type=int, default=0, metavar="N")
    parser.add_argument("--rounds", type=int, default=2, metavar="N")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if args.nbgrader:
            against_nbgrader(folder, args.nbgrader, args.rounds)
            return
        for hostile in (0, args.hostile):
            shutil.rmtree(folder / "submitted", ignore_errors=True)
            write_class(folder / "submitted", args.students, hostile)
            seconds = grade(folder)
            print(f"{args.students} students, {hostile} hostile: {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
