"""A real nbgrader releases, takes in and grades the lab's notebook, and its scores are ours."""

import csv
import inspect
import json
import os
import subprocess
from pathlib import Path

import pytest
from right_answers import plain_python

from labkit.authoring.notebook import notebook_text
from labkit.cli import main
from labkit.grading.assignment import load_assignment
from labkit.grading.sandbox.host import available_modes

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv-graders/bin/python"
COURSE = Path(__file__).parent / "others/nbgrader_course.py"
SAFE = any(not why for mode, why in available_modes().items() if mode != "none")
WHERE = [] if SAFE else ["--no-isolation"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not PYTHON.exists(),
        reason="needs nbgrader: python -m venv .venv-graders; .venv-graders/bin/pip install "
        "-r tests/grading/others/requirements.txt -e .",
    ),
]

MISTAKEN = (
    "import numpy as np\n"
    "def rotation(theta):\n"
    "    c, s = np.cos(theta), np.sin(theta)\n"
    "    return np.array([[c, s], [-s, c]])\n"
    "def huber_weights(residuals, delta):\n"  # right, with a warning of a division by zero
    "    return np.where(residuals <= delta, 1.0, delta / residuals)\n"
    "def overlap(*arguments):\n"
    "    return 1 / 0\n"
    "def distance_gate(distances, max_distance):\n"
    "    return [d <= max_distance for d in distances]\n"
)


def nbgrader(folder):
    """What nbgrader prints of the course in a folder, once it has made or graded it."""
    command = [PYTHON, COURSE, folder]
    path = f"{PYTHON.parent}{os.pathsep}{os.environ['PATH']}"  # it calls alembic by name
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env={**os.environ, "PATH": path},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def answered(release, source):
    """The released notebook with all of a student's functions in the first cell for answers."""
    notebook = json.loads(release)
    for cell in notebook["cells"]:
        if cell["metadata"].get("nbgrader", {}).get("solution"):
            cell["source"], source = source, ""
    return json.dumps(notebook)


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """The folder of a course whose students have handed in, and nbgrader's scores of them."""
    folder = tmp_path_factory.mktemp("course")
    (folder / "source/lab1").mkdir(parents=True)
    (folder / "source/lab1/assignment.ipynb").write_text(notebook_text(True), encoding="utf-8")
    nbgrader(folder)
    release = (folder / "release/lab1/assignment.ipynb").read_text(encoding="utf-8")
    handed_in = {
        "ada": answered(release, inspect.getsource(plain_python)),
        "emmy": answered(release, MISTAKEN),
        "grace": release,
    }
    for student, notebook in handed_in.items():
        path = folder / f"submitted/{student}/lab1/assignment.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(notebook, encoding="utf-8")
    return folder, json.loads(nbgrader(folder))


def test_the_release_shows_no_solution_and_no_hidden_test(course):
    release = (course[0] / "release/lab1/assignment.ipynb").read_text(encoding="utf-8")
    assert "SOLUTION" not in release
    assert "HIDDEN" not in release
    assert "score(" not in release
    assert stubs(release) == stubs(notebook_text())


def stubs(notebook):
    """The code of the cells for answers; nbgrader writes the error that they raise as a call."""
    cells = json.loads(notebook)["cells"]
    answers = (one for one in cells if one["metadata"].get("nbgrader", {}).get("solution"))
    return ["".join(cell["source"]).replace("Error()", "Error") for cell in answers]


def test_its_scores_are_ours(course, tmp_path, monkeypatch):
    """Takes some half a minute; buys that either grader can be used on one hand-out."""
    folder, theirs = course
    monkeypatch.chdir(tmp_path)
    assert main(["grade", str(folder / "submitted"), "--no-html", *WHERE]) == 0
    with (tmp_path / "grades/scores.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            ours = {question: float(row[question]) for question in theirs[row["student"]]}
            assert ours == pytest.approx(theirs[row["student"]])
    totals = {student: sum(scores.values()) for student, scores in theirs.items()}
    assert totals["ada"] == load_assignment().points
    assert 0.0 < totals["emmy"] < 11.0
    full = load_assignment().question("huber_weights").points
    assert theirs["emmy"]["huber_weights"] == full, "a warning on stderr cost nbgrader's points"
    assert totals["grace"] == 0.0
