"""Results say what verdicts say; the autograder grades as Gradescope calls it."""

import json
import subprocess
import sys
import sysconfig
import zipfile

import pytest

from labkit.grading.classroom.gradescope import results_of, write_autograder
from tests.grading.small import RIGHT, SQUARED


def test_gradescope_has_a_test_for_each_question_and_hides_the_hidden_cases(verdicts):
    for verdict in verdicts:
        results = json.loads(json.dumps(results_of(verdict), allow_nan=False))
        scored = [test for test in results["tests"] if "score" in test]
        hidden = [test for test in results["tests"] if "score" not in test]
        assert sum(test["score"] for test in scored) == results["score"] == verdict.score
        assert results["stdout_visibility"] == "hidden"
        assert [test["visibility"] for test in hidden] == ["hidden"] * len(verdict.questions)
    visible = results_of(verdicts[1])["tests"][0]
    assert visible["output"] == (
        "About gate.\n\nA wide gate: it returned a list.\n\n0 of 2 cases pass."
    )


@pytest.fixture
def root(small, tmp_path):
    """Gradescope's /autograder after ``setup.sh``, with this interpreter for its own.

    It knows the installed packages, but of labkit only what the archive holds (``-S``).
    """
    write_autograder(tmp_path / "autograder.zip", small)
    root = tmp_path / "autograder"
    with zipfile.ZipFile(tmp_path / "autograder.zip") as archive:
        archive.extractall(root / "source")
    python = root / "source/venv/bin/python"
    python.parent.mkdir(parents=True)
    packages = sysconfig.get_path("purelib")
    python.write_text(
        f'#!/bin/sh\nPYTHONPATH="{packages}" exec "{sys.executable}" -S "$@"\n', encoding="utf-8"
    )
    python.chmod(0o755)
    (root / "submission").mkdir()
    return root


def run_autograder(root):
    """The results, and what instructors see of the run."""
    script = root / "source/run_autograder"
    environment = {"AUTOGRADER": str(root), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        ["bash", script], env=environment, check=True, capture_output=True, text=True
    )
    return json.loads((root / "results/results.json").read_text(encoding="utf-8")), done.stdout


def test_a_submission_is_graded_by_what_the_archive_holds(safe_wall, root):
    (root / "submission/answers.py").write_text(SQUARED, encoding="utf-8")
    results, _ = run_autograder(root)
    assert results["score"] == 3.5
    assert results["tests"][0]["score"] == 0.5
    assert "this is x squared" in results["tests"][0]["output"]


def test_a_grader_that_fails_says_so_and_blames_nobody(root):
    (root / "submission/answers.py").write_text(RIGHT, encoding="utf-8")
    for file in (root / "source/assignment").rglob("*.json"):
        file.unlink()
    results, seen = run_autograder(root)
    assert "it is not your fault" in results["output"]
    assert (results["score"], results["stdout_visibility"]) == (0, "hidden")
    assert "questions.json: No such file" in seen


def test_the_archive_holds_the_course_s_cases_what_its_image_needs_and_no_answers(root):
    full = {path for path in root.glob("source/labkit/**/*.*") if path.stat().st_size}
    rooms = {path.relative_to(root / "source/labkit").parts[0] for path in full}
    assert rooms == {"grading", "support"}
    assert [path.name for path in root.glob("source/assignment/hidden/*")] == ["cases.json"]
    requirements = (root / "source/requirements.txt").read_text(encoding="utf-8")
    assert "numpy" in requirements
    assert "extra" not in requirements
    with zipfile.ZipFile(root.with_suffix(".zip")) as archive:
        assert archive.getinfo("run_autograder").external_attr >> 16 == 0o100755
