"""A real nbgrader releases, takes in and grades the lab's notebook, and its scores are ours."""

import csv
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from right_answers import plain_python, solution, source_of

from labkit.cli import main
from labkit.course.authoring.write import notebook_text
from labkit.course.grading.assignment import load_assignment

ROOT = Path(__file__).parents[3]
PYTHON = ROOT / ".venv-graders/bin/python"
QUESTIONS = {question.id for question in load_assignment().questions}
IN_WORDS = {"killian_answers", "killian_failure_answer"}
COURSE = Path(__file__).parent / "others/nbgrader_course.py"
WHERE = [] if shutil.which("bwrap") else ["--no-isolation"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.others,
    pytest.mark.skipif(
        not PYTHON.exists(),
        reason="needs nbgrader: python -m venv .venv-graders; .venv-graders/bin/pip install "
        "-r tests/course/grading/others/requirements.txt -e .",
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
    path = f"{PYTHON.parent}{os.pathsep}{os.environ['PATH']}"  # it calls alembic by name
    options = {"capture_output": True, "text": True, "cwd": folder}
    command, env = [PYTHON, COURSE, folder], os.environ | {"PATH": path}
    done = subprocess.run(command, check=False, env=env, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def answered(release, source):
    """The release with words for answers, and all functions in the first cell for code."""
    notebook = json.loads(release)
    for cell in notebook["cells"]:
        if is_for_answers(cell, "markdown"):
            cell["source"] = "The wheels slipped."
        elif is_for_answers(cell, "code"):
            cell["source"], source = source, ""
    return json.dumps(notebook)


def is_for_answers(cell, kind):
    return cell["cell_type"] == kind and cell["metadata"].get("nbgrader", {}).get("solution")


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """The folder of a course whose students have handed in, and nbgrader's scores of them."""
    folder = tmp_path_factory.mktemp("course")
    (folder / "source/lab1").mkdir(parents=True)
    (folder / "source/lab1/assignment.ipynb").write_text(
        notebook_text(solutions=True), encoding="utf-8"
    )
    nbgrader(folder)
    release = (folder / "release/lab1/assignment.ipynb").read_text(encoding="utf-8")
    assert not any(word in release for word in ("SOLUTION", "HIDDEN", "score("))
    handed_in = {
        "ada": answered(release, source_of(solution) + source_of(plain_python)),
        "emmy": answered(release, MISTAKEN),
        "grace": release,
    }
    for student, notebook in handed_in.items():
        path = folder / f"submitted/{student}/lab1/assignment.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(notebook, encoding="utf-8")
    return folder, json.loads(nbgrader(folder))


def test_its_scores_are_ours(course, tmp_path, monkeypatch):
    """Takes some half a minute; buys that either grader can be used on one hand-out."""
    folder, theirs = course
    monkeypatch.chdir(tmp_path)
    assert main(["grade", str(folder / "submitted"), *WHERE]) == 0
    with (tmp_path / "grades/scores.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            ours = {question: float(row[question]) for question in QUESTIONS}
            assert ours == pytest.approx(by_machine(theirs[row["student"]]))
    totals = {student: sum(by_machine(scores).values()) for student, scores in theirs.items()}
    assert (totals["ada"], totals["grace"]) == (load_assignment().points, 0.0)
    full = load_assignment().question("huber_weights").points
    assert theirs["emmy"]["huber_weights"] == full, "a warning on stderr cost nbgrader's points"
    for student, score in (("ada", None), ("emmy", None), ("grace", 0.0)):  # answers in words
        scores = theirs[student]
        assert {scores[name] for name in IN_WORDS} == {score}


def by_machine(scores):
    """A student's scores without those of the answers in words, which the instructor reads."""
    return {name: score for name, score in scores.items() if name not in IN_WORDS}
