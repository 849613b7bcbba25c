"""Gradescope's file is as specified, and a real otter-grader takes the notebook and the scores.

No part of otter-grader reads another grader's ``results.json`` by itself; a plugin, which is
its own way for scores from elsewhere, does here. The file itself is held to the specification,
and so is the one that otter writes, lest the schema be stricter than what Gradescope takes.
"""

import inspect
import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from labkit.cli import main
from labkit.course.authoring import solution
from labkit.course.authoring.notebook import notebook_text
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.sandbox.host import available_modes

sys.path.insert(0, str(Path(__file__).parent / "others"))
from results_schema import RESULTS

OTHERS = Path(__file__).parent / "others"
PYTHON = Path(__file__).parents[3] / ".venv-graders/bin/python"
SAFE = any(not why for mode, why in available_modes().items() if mode != "none")
WHERE = [] if SAFE else ["--no-isolation"]
QUESTIONS = load_assignment().questions

needs_otter = pytest.mark.skipif(
    not PYTHON.exists(),
    reason="needs otter-grader: python -m venv .venv-graders; .venv-graders/bin/pip install "
    "-r tests/course/grading/others/requirements.txt -e .",
)

MISTAKEN = {
    "rotation": "def rotation(theta):\n"
    "    c, s = np.cos(theta), np.sin(theta)\n"
    "    return np.array([[c, s], [-s, c]])",
    "huber_weights": "def huber_weights(residuals, delta):\n    return 1 / 0",
}
TEST = """\
OK_FORMAT = False

from labkit.course.grading.check import score
from otter.test_files import test_case

name = "{id}"
points = {points}


@test_case(points={points}, hidden=True)
def test_{id}({function}):
    assert score("{id}", {function}) == {points}
"""


def notebook(answers):
    """The notebook as handed out, with functions in the cells of their questions."""
    content = json.loads(notebook_text())
    names = {question.id.replace("_", "-"): question.function for question in QUESTIONS}
    for cell in content["cells"]:
        name = names.get(cell["id"])
        cell["source"] = answers.get(name, cell["source"])
    return json.dumps(content)


HANDED_IN = {
    "ada": notebook(
        {one.function: inspect.getsource(getattr(solution, one.function)) for one in QUESTIONS}
    ),
    "emmy": notebook(MISTAKEN),
}


def labkit(folder, student):
    """What labkit makes of a submission: its results.json, read."""
    path, out = folder / f"{student}.ipynb", folder / f"grades-{student}"
    path.write_text(HANDED_IN[student], encoding="utf-8")
    file = folder / f"{student}.json"
    command = ["grade", str(path), "--student", student, "--no-html", "--jobs", "1", *WHERE]
    assert main([*command, "--out", str(out), "--gradescope", str(file)]) == 0
    return json.loads(file.read_text(encoding="utf-8"))


def scores_of(results):
    """The score of each question in labkit's results.json."""
    return {test["tags"][0]: test["score"] for test in results["tests"] if "score" in test}


def otter(folder, students, **config):
    """What otter prints as scores, and what it writes for Gradescope, by student."""
    (folder / "tests").mkdir()
    for question in QUESTIONS:
        text = TEST.format(id=question.id, points=question.points, function=question.function)
        (folder / f"tests/{question.id}.py").write_text(text, encoding="utf-8")
    (folder / "otter_config.json").write_text(json.dumps(config), encoding="utf-8")
    for student in students:
        path = folder / f"submitted/{student}/assignment.ipynb"
        path.parent.mkdir(parents=True)
        path.write_text(HANDED_IN[student], encoding="utf-8")
    done = subprocess.run(
        [PYTHON, OTHERS / "otter_course.py", folder], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    written = {
        student: json.loads((folder / f"results/{student}.json").read_text(encoding="utf-8"))
        for student in students
    }
    return json.loads(done.stdout), written


@pytest.mark.parametrize("student", HANDED_IN)
def test_results_json_is_as_gradescope_specifies_it(student, tmp_path):
    results = labkit(tmp_path, student)
    jsonschema.validate(results, RESULTS)
    assert results["score"] == pytest.approx(sum(scores_of(results).values()))
    assert sum(test.get("max_score", 0.0) for test in results["tests"]) == 100.0
    numbers = [test["number"] for test in results["tests"]]
    assert len(set(numbers)) == len(numbers)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"score": "100"}, "'100' is not of type 'number'"),
        ({"visibility": "private"}, "'private' is not one of"),
        ({"marks": 3}, "'marks' was unexpected"),
        ({"tests": [{"status": "ok"}]}, "'ok' is not one of"),
        ({"tests": [{"max_score": 3.0}]}, "'score' is a dependency of 'max_score'"),
        ({"execution_time": -1.0}, "-1.0 is less than the minimum"),
    ],
)
def test_the_schema_refuses_what_gradescope_does_not_know(change, why):
    results = {"score": 1.0, "tests": [{"score": 1.0, "max_score": 1.0}]}
    jsonschema.validate(results, RESULTS)
    with pytest.raises(jsonschema.ValidationError, match=why):
        jsonschema.validate(results | change, RESULTS)


@needs_otter
@pytest.mark.slow
@pytest.mark.others
def test_otter_grades_the_notebook_and_agrees(tmp_path):
    """Some ten seconds; buys that the hand-out runs in otter's harness and is graded alike.

    Otter's cases pass or fail, so what labkit gives in part is nothing there.
    """
    theirs, written = otter(tmp_path, HANDED_IN)
    for student in HANDED_IN:
        ours = scores_of(labkit(tmp_path, student))
        whole = {
            question.id: question.points if ours[question.id] == question.points else 0.0
            for question in QUESTIONS
        }
        assert theirs[student] == whole
        jsonschema.validate(written[student], RESULTS)
    assert sum(theirs["ada"].values()) == 100.0
    assert sum(theirs["emmy"].values()) == 0.0


@needs_otter
@pytest.mark.slow
@pytest.mark.others
def test_otter_takes_the_scores_of_results_json(tmp_path):
    """Some eight seconds; buys that otter's own results carry labkit's partial credit."""
    plugin = {"otter_plugin.LabkitScores": {"student": "emmy", "options": WHERE}}
    theirs, written = otter(tmp_path, ["emmy"], plugins=[plugin])
    results = labkit(tmp_path, "emmy")
    assert theirs["emmy"] == scores_of(results)
    assert 0.0 < results["score"] < 3.0
    jsonschema.validate(written["emmy"], RESULTS)
    assert written["emmy"]["output"] == results["output"]
    given = {test["name"]: test["score"] for test in written["emmy"]["tests"] if "score" in test}
    assert given == scores_of(results)
