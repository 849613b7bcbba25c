"""Results say what verdicts say; the autograder grades as Gradescope calls it."""

import json
import subprocess
import sys
import sysconfig
import zipfile

import pytest
from small import RIGHT, SQUARED

from labkit.course.grading.exports.gradescope import read_metadata, results_of, write_autograder
from labkit.support.errors import LabkitError


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
    rules = tmp_path / "adjustments.csv"
    rules.write_text("student,what,value\n*,late_percent,10\nada,double,0\n", encoding="utf-8")
    write_autograder(tmp_path / "autograder.zip", small, rules)
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


@pytest.mark.parametrize(
    "rule", ["late_percnt,10", "late_percent,-10", "late_percent,101", "icp,3"]
)
def test_a_wrong_rule_of_the_class_is_refused_before_the_archive_is_written(small, tmp_path, rule):
    rules = tmp_path / "adjustments.csv"
    rules.write_text(f"student,what,value\n*,{rule}\n", encoding="utf-8")
    with pytest.raises(LabkitError, match="line 2: "):
        write_autograder(tmp_path / "autograder.zip", small, rules)
    assert not (tmp_path / "autograder.zip").exists()


def run_autograder(root):
    """The results, and what instructors see of the run."""
    script = root / "source/run_autograder"
    environment = {"AUTOGRADER": str(root), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        ["bash", script], env=environment, check=True, capture_output=True, text=True
    )
    return json.loads((root / "results/results.json").read_text(encoding="utf-8")), done.stdout


def test_a_submission_is_graded_under_its_owner_and_late(safe_wall, root):
    users = [{"id": 7, "email": "emmy@x.org"}, {"id": 8, "email": "ada@x.org"}]
    due = {"due_date": "2026-11-20T23:59:00.000000-08:00"}
    metadata = {"users": users, "assignment": due, "created_at": "2026-11-22T23:59:00.0-08:00"}
    (root / "submission_metadata.json").write_text(json.dumps(metadata), encoding="utf-8")
    (root / "submission/answers.py").write_text(SQUARED, encoding="utf-8")
    results, _ = run_autograder(root)
    assert results["score"] == 2.8  # of 3.5, two days late
    assert results["tests"][0]["score"] == 0.5
    assert "this is x squared" in results["tests"][0]["output"]


@pytest.mark.parametrize(
    ("told", "late"),
    [
        ({"users": [{"id": 7}]}, 0.0),
        ({"users": [{"id": 7, "assignment": {"due_date": "2026-11-23T00:00:00+00:00"}}],
          "assignment": {"due_date": "2026-11-20T00:00:00+00:00"}}, 0.5),
        ({"users": [{"id": 7}], "assignment": {"due_date": None}}, 0.0),
    ],
)  # fmt: skip
def test_an_extension_in_gradescope_counts(told, late, tmp_path):
    path = tmp_path / "metadata.json"
    path.write_text(json.dumps({"created_at": "2026-11-23T12:00:00+00:00"} | told))
    assert read_metadata(path) == ("7", late)
    path.write_text("[]")
    with pytest.raises(LabkitError, match=r"metadata\.json: is not Gradescope's sub"):
        read_metadata(path)


def test_a_grader_that_fails_says_so_and_blames_nobody(root):
    (root / "submission/answers.py").write_text(RIGHT, encoding="utf-8")
    (root / "submission_metadata.json").write_text('{"users": []}', encoding="utf-8")
    for file in (root / "source/labkit/course/grading/assignment").rglob("*.json"):
        file.unlink()
    results, seen = run_autograder(root)
    assert "it is not your fault" in results["output"]
    assert (results["score"], results["stdout_visibility"]) == (0, "hidden")
    assert "questions.json: No such file" in seen


def test_the_archive_holds_the_course_s_cases_and_what_its_image_needs(root):
    held = {path.name for path in root.rglob("variant_*.json")}
    assert held == {"variant_0.json", "variant_1.json"}
    requirements = (root / "source/requirements.txt").read_text(encoding="utf-8")
    assert "numpy" in requirements
    assert "extra" not in requirements
    with zipfile.ZipFile(root.with_suffix(".zip")) as archive:
        assert archive.getinfo("run_autograder").external_attr >> 16 == 0o100755
