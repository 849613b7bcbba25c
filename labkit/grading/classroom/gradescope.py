"""The archive that grades in Gradescope by its autograder specifications, and what runs in it.

Each question is a test with its score; each of its hidden cases is one more, without points,
that only the instructors see. In the archive, ``setup.sh`` builds the image, and
``run_autograder`` calls this module for one submission, without a store and without pages.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import zipfile
from collections.abc import Iterable, Iterator
from importlib.metadata import PackageNotFoundError, packages_distributions, requires, version
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

from labkit.grading.box.outside import open_wall
from labkit.grading.classroom.handins import one_submission
from labkit.grading.classroom.rounds import make_record
from labkit.grading.judge.verdict import SubmissionVerdict
from labkit.grading.questions import read_assignment
from labkit.support.files import atomic_write

HERE = Path(__file__).with_name("autograder")
PACKAGE = HERE.parents[2]
EXTRAS = ("", "grading", "notebooks")
SCRIPTS = ("setup.sh", "run_autograder")
NEEDED = [PACKAGE / "grading", PACKAGE / "support"]


def grade_for_gradescope(root: Path) -> None:
    """Grade ``root/submission``, and write ``root/results/results.json``."""
    submission = one_submission(root / "submission", "student")  # Gradescope knows who it is
    assignment = root / "source/assignment"
    read_assignment(assignment)  # or say what is missing, before a wall is tried
    wall = open_wall((assignment / "hidden", root / "submission"))
    verdict = make_record(submission, str(assignment), wall).verdict
    with atomic_write(root / "results" / "results.json") as file:
        json.dump(results_of(verdict), file, indent=1)


def results_of(verdict: SubmissionVerdict) -> dict[str, Any]:
    """A verdict as Gradescope reads it."""
    tests: list[dict[str, Any]] = []
    for place, question in enumerate(verdict.questions, 1):
        reasons = [case.reason for case in question.cases if not case.hidden]
        count = "" if question.cases_passed in question.message else question.cases_passed
        test = _test(
            f"{place}", question.title, question.passed, [question.message, *reasons, count]
        )
        tests.append(test | {"score": round(question.score, 6), "max_score": question.points})
        for n, case in enumerate((case for case in question.cases if case.hidden), 1):
            name = f"{question.title}, hidden case {case.id}"
            test = _test(f"{place}.{n}", name, case.passed, [case.reason])
            tests.append(test | {"visibility": "hidden"})
    return {
        "score": round(verdict.score, 6),
        **_output([f"Graded in isolation: {verdict.mode}.", *verdict.remarks]),
        "stdout_visibility": "hidden",
        "tests": tests,
    }


def _test(number: str, name: str, passed: bool, sentences: Iterable[str]) -> dict[str, Any]:
    status = "passed" if passed else "failed"
    return {"number": number, "name": name, "status": status, **_output(sentences)}


def _output(sentences: Iterable[str]) -> dict[str, str]:
    """Texts as Gradescope shows them to a student, each once."""
    output = "\n\n".join(filter(None, dict.fromkeys(sentences)))
    return {"output": output, "output_format": "text", "visibility": "visible"}


def write_autograder(path: str | os.PathLike[str], assignment: str | os.PathLike[str]) -> None:
    """Write the zip archive to upload as "autograder" of a programming assignment.

    It holds the hidden cases of the `assignment` in a folder. Of labkit it holds the grading; the
    other files are empty there, and by their names a copy of labkit is known among what a student
    hands in.
    """
    folder = Path(assignment).resolve()
    with (
        atomic_write(path, "wb") as file,
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive,
    ):
        for script in SCRIPTS:
            info = zipfile.ZipInfo(script)
            info.external_attr = 0o100755 << 16  # Gradescope runs it
            archive.writestr(info, (HERE / script).read_bytes())
        archive.writestr("requirements.txt", "\n".join([*packages_of_students(), ""]))
        for source in sorted(PACKAGE.rglob("*")):
            place = str(source.relative_to(PACKAGE.parent))
            if any(folder in source.parents for folder in NEEDED):
                if source.is_file() and "__pycache__" not in source.parts:
                    archive.write(source, place)
            elif source.suffix == ".py":
                archive.writestr(place, b"")
        for source in sorted(folder.rglob("*.json")):
            archive.write(source, Path("assignment", source.relative_to(folder)))


def packages_of_students() -> Iterator[str]:
    """The packages that a student's code may import, in the versions that are installed here.

    The same hand-in then has the same mark in Gradescope's image.
    """
    for text in requires(packages_distributions()["labkit"][0]) or []:
        requirement = Requirement(text)
        marker = requirement.marker
        is_needed = any(not marker or marker.evaluate({"extra": extra}) for extra in EXTRAS)
        if is_needed and not requirement.extras:
            with contextlib.suppress(PackageNotFoundError):
                yield f"{requirement.name}=={version(requirement.name)}"


if __name__ == "__main__":
    grade_for_gradescope(Path(sys.argv[1]))
