"""The archive that grades in Gradescope by its autograder specifications, and what runs in it.

Each question is a test with its score; each of its hidden cases is one more, without points,
that only the instructors see. In the archive, ``setup.sh`` builds the image, and
``run_autograder`` calls this module for one submission, without a store and without pages.
"""

from __future__ import annotations

import json
import os
import re
import sys
import zipfile
from collections.abc import Iterable
from importlib.metadata import requires
from pathlib import Path
from typing import Any

from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.box import open_wall
from labkit.course.grading.grade import grade_one
from labkit.course.grading.handins import one_submission
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.support.files import atomic_write

HERE = Path(__file__).with_name("autograder")
PACKAGE = HERE.parents[3]
SCRIPTS = ("setup.sh", "run_autograder")
ANSWERS = PACKAGE / "course" / "authoring"


def grade_for_gradescope(root: Path) -> None:
    """Grade ``root/submission``, and write ``root/results/results.json``."""
    users = json.loads((root / "submission_metadata.json").read_text("utf-8"))["users"]
    student = ", ".join(sorted(str(user.get("email") or user["id"]) for user in users))
    submission = one_submission(root / "submission", student)
    load_assignment()  # or say what is missing, before a wall is tried
    wall = open_wall((FOLDER / "hidden", root / "submission"))
    verdict = grade_one(submission, str(FOLDER), wall).verdict
    with atomic_write(root / "results" / "results.json") as file:
        json.dump(results_of(verdict), file, indent=1)


def results_of(verdict: SubmissionVerdict) -> dict[str, Any]:
    """A verdict as Gradescope reads it."""
    tests: list[dict[str, Any]] = []
    for place, one in enumerate(verdict.questions, 1):
        reasons = [case.reason for case in one.cases if not case.hidden]
        count = "" if one.cases_passed in one.message else one.cases_passed
        told = _test(f"{place}", one.title, one.passed, [one.message, *reasons, count])
        tests.append(told | {"score": round(one.score, 6), "max_score": one.points})
        for n, case in enumerate((case for case in one.cases if case.hidden), 1):
            name = f"{one.title}, hidden case {case.id}"
            told = _test(f"{place}.{n}", name, case.passed, [case.reason])
            tests.append(told | {"visibility": "hidden"})
    return {
        "score": round(verdict.score, 6),
        **_shown([f"Graded in isolation: {verdict.mode}.", *verdict.remarks]),
        "stdout_visibility": "hidden",
        "tests": tests,
    }


def _test(number: str, name: str, passed: bool, told: Iterable[str]) -> dict[str, Any]:
    status = "passed" if passed else "failed"
    return {"number": number, "name": name, "status": status, **_shown(told)}


def _shown(told: Iterable[str]) -> dict[str, str]:
    """Texts as Gradescope shows them to a student, each once."""
    text = "\n\n".join(filter(None, dict.fromkeys(told)))
    return {"output": text, "output_format": "text", "visibility": "visible"}


def write_autograder(path: str | os.PathLike[str], assignment: str | os.PathLike[str]) -> None:
    """Write the zip archive to upload as "autograder" of a programming assignment.

    It holds the hidden cases of the `assignment` in a folder. The files that write assignments are
    empty there: grading needs none of their answers, but by their names it knows a copy of labkit
    among what a student hands in.
    """
    folder = Path(assignment).resolve()
    needed = re.compile(r"(numpy|scipy)\b(?!.*extra ==)")
    with (
        atomic_write(path, "wb") as file,
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive,
    ):
        for script in SCRIPTS:
            info = zipfile.ZipInfo(script)
            info.external_attr = 0o100755 << 16  # Gradescope runs it
            archive.writestr(info, (HERE / script).read_bytes())
        own = filter(needed.match, requires("labkit") or [])
        archive.writestr("requirements.txt", "\n".join([*own, ""]))
        for source in filter(Path.is_file, sorted(PACKAGE.rglob("*"))):
            place = source.relative_to(PACKAGE.parent)
            lab = FOLDER in source.parents and source.suffix == ".json"  # the folder's instead
            if ANSWERS in source.parents:
                archive.writestr(str(place), b"")
            elif not lab and "__pycache__" not in place.parts:
                archive.write(source, place)
        for source in sorted(folder.rglob("*.json")):
            place = FOLDER.relative_to(PACKAGE.parent) / source.relative_to(folder)
            archive.write(source, place)


if __name__ == "__main__":
    grade_for_gradescope(Path(sys.argv[1]))
