"""A real nbgrader releases, takes in and grades the lab's notebook, and its scores are ours."""

import csv
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from labkit.cli import main
from labkit.course.assignment import load_assignment
from labkit.course.authoring.write import notebook_text
from tests.course.authoring.right_answers import plain_python, solution, source_of

ASSIGNMENT = load_assignment()
PYTHON = Path(__file__).parents[2] / ".venv-graders/bin/python"
IN_WORDS = {"killian_answers", "killian_failure_answer"}
WHERE = [] if shutil.which("bwrap") else ["--no-isolation"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.others,
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
SCORES = """
import json
from nbgrader.api import Gradebook
with Gradebook("sqlite:///gradebook.db") as gradebook:
    print(json.dumps({
        one.student.id: {
            grade.name.removeprefix("check-").replace("-", "_"): grade.auto_score
            for notebook in one.notebooks for grade in notebook.grades
        } for one in gradebook.assignment_submissions("lab1")
    }))
"""


def run(folder, *arguments):
    """What Python prints in nbgrader's environment."""
    env = os.environ | {"PATH": f"{PYTHON.parent}{os.pathsep}{os.environ['PATH']}"}  # for alembic
    done = subprocess.run(
        [PYTHON, *arguments], cwd=folder, env=env, check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def answered(release, source):
    """The release with words for answers, and all functions in the first cell for code."""
    notebook = json.loads(release)
    for cell in notebook["cells"]:
        if cell["metadata"].get("nbgrader", {}).get("solution"):
            words = cell["cell_type"] == "markdown"
            cell["source"] = "The wheels slipped." if words else source
            source = source if words else ""
    return json.dumps(notebook)


def test_its_scores_are_ours(tmp_path, monkeypatch):
    """Takes some half a minute; buys that either grader can be used on one hand-out."""
    made = tmp_path / "source/lab1/assignment.ipynb"
    made.parent.mkdir(parents=True)
    made.write_text(notebook_text(solutions=True), encoding="utf-8")
    run(tmp_path, "-m", "nbgrader", "generate_assignment", "lab1", "--create", "--force")
    release = (tmp_path / "release/lab1/assignment.ipynb").read_text(encoding="utf-8")
    assert not any(word in release for word in ("SOLUTION", "HIDDEN", "score("))
    handed_in = {
        "ada": answered(release, source_of(solution) + source_of(plain_python)),
        "emmy": answered(release, MISTAKEN),
        "grace": release,
    }
    for student, notebook in handed_in.items():
        path = tmp_path / f"submitted/{student}/lab1/assignment.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(notebook, encoding="utf-8")
    run(tmp_path, "-m", "nbgrader", "autograde", "lab1", "--create", "--force")
    theirs = json.loads(run(tmp_path, "-c", SCORES))
    in_words = {name: {theirs[name].pop(one) for one in IN_WORDS} for name in handed_in}
    assert in_words == {"ada": {None}, "emmy": {None}, "grace": {0.0}}
    full = ASSIGNMENT.question("huber_weights").points
    assert theirs["emmy"]["huber_weights"] == full, "a warning on stderr cost nbgrader's points"
    assert sum(theirs["ada"].values()) == ASSIGNMENT.points
    monkeypatch.chdir(tmp_path)
    assert main(["grade", "submitted", *WHERE]) == 0
    with Path("grades/scores.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            ours = {one.id: float(row[one.id]) for one in ASSIGNMENT.questions}
            assert ours == pytest.approx(theirs[row["student"]])


FILLED = """
from nbgrader.api import Gradebook
with Gradebook("sqlite:///grades/nbgrader.db") as gradebook:
    for one in gradebook.assignment_submissions("lab1"):
        print(one.student.id, one.score, one.max_score, one.needs_manual_grade)
"""


def test_its_gradebook_takes_our_points(tmp_path, monkeypatch):
    """Takes some fifteen seconds; buys that its formgrader shows them, without its grading."""
    made = tmp_path / "source/lab1/assignment.ipynb"
    handed_in = [tmp_path / f"submitted/{student}/lab1/a.py" for student in ("ada", "emmy")]
    for path in (made, *handed_in):
        path.parent.mkdir(parents=True)
        path.write_text(MISTAKEN, encoding="utf-8")
    made.write_text(notebook_text(solutions=True), encoding="utf-8")
    run(tmp_path, "-m", "nbgrader", "generate_assignment", "lab1", "--create", "--force")
    monkeypatch.chdir(tmp_path)

    assert main(["grade", "submitted", "--nbgrader", "gradebook.db", "lab1", *WHERE]) == 0

    assert run(tmp_path, "-c", FILLED) == "ada 9.0 100.0 False\nemmy 9.0 100.0 False\n"
