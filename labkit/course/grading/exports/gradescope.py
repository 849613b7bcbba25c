"""Gradescope: the archive that grades there, and what runs in it [1]_.

Each question is a test with its score; each of its hidden cases is one more, without points,
that only the instructors see. In the archive, ``setup.sh`` builds the image, and
``run_autograder`` calls this module for one submission, without a store and without pages.

References
----------
.. [1] Gradescope, "Autograder specifications".
"""

from __future__ import annotations

import json
import os
import re
import sys
import zipfile
from collections.abc import Iterable
from datetime import datetime
from importlib.metadata import requires
from pathlib import Path
from typing import Any

from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.box import open_wall
from labkit.course.grading.grade import grade_one
from labkit.course.grading.handins import one_submission
from labkit.course.grading.judging.verdict import SubmissionVerdict
from labkit.course.grading.marks import ADJUSTMENTS, CLASS, HEADER, adjusted, read_adjustments
from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write

HERE = Path(__file__).with_name("autograder")
PACKAGE = HERE.parents[3]
SCRIPTS = ("setup.sh", "run_autograder")


def grade_for_gradescope(root: Path) -> None:
    """Grade ``root/submission``, and write ``root/results/results.json``."""
    student, days = read_metadata(root / "submission_metadata.json")
    submission = one_submission(root / "submission", student)
    rules = read_adjustments(ADJUSTMENTS, load_assignment(), None)  # before a wall is tried
    wall = open_wall([FOLDER / "hidden", root / "submission"])
    verdict = grade_one(submission, str(FOLDER), wall).verdict
    with atomic_write(root / "results" / "results.json") as file:
        json.dump(results_of(adjusted(verdict, days, rules)), file, indent=1)


def results_of(verdict: SubmissionVerdict) -> dict[str, Any]:
    """A verdict as Gradescope reads it."""
    tests: list[dict[str, Any]] = []
    for place, one in enumerate(verdict.questions, 1):
        reasons = [case.reason for case in one.cases if not case.hidden]
        count = "" if one.cases_passed in one.message else one.cases_passed
        told = _shown([one.message, *reasons, count])
        head = _head(f"{place}", one.title, one.passed)
        tests.append({**head, **told, "score": round(one.score, 6), "max_score": one.points})
        for n, case in enumerate((case for case in one.cases if case.hidden), 1):
            head = _head(f"{place}.{n}", f"{one.title}, hidden case {case.id}", case.passed)
            tests.append({**head, **_shown([case.reason]), "visibility": "hidden"})
    return {
        "score": round(verdict.score, 6),
        **_shown([f"Graded in isolation: {verdict.mode}.", *verdict.remarks]),
        "stdout_visibility": "hidden",
        "tests": tests,
    }


def _head(number: str, name: str, passed: bool) -> dict[str, str]:
    return {"number": number, "name": name, "status": "passed" if passed else "failed"}


def _shown(told: Iterable[str]) -> dict[str, str]:
    """Texts as Gradescope shows them to a student, each once."""
    text = "\n\n".join(filter(None, dict.fromkeys(told)))
    return {"output": text, "output_format": "text", "visibility": "visible"}


def read_metadata(path: Path) -> tuple[str, float]:
    """Read the student and the days after the due date from ``submission_metadata.json``."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        users = sorted(str(user.get("email") or user["id"]) for user in told["users"])
        due = told.get("assignment", {}).get("due_date")
        for user in told["users"]:  # an extension of their own
            due = user.get("assignment", {}).get("due_date") or due
        times = [datetime.fromisoformat(time) for time in (told.get("created_at"), due) if time]
        late = (times[0] - times[1]).total_seconds() if len(times) == 2 else 0.0
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise LabkitError(
            f"{path}: is not Gradescope's submission_metadata.json: {error}"
        ) from None
    return ", ".join(users), max(0.0, late / 86400.0)


def write_autograder(
    path: str | os.PathLike[str],
    assignment: str | os.PathLike[str] = FOLDER,
    adjustments: str | os.PathLike[str] | None = None,
) -> None:
    """Write the zip archive to upload as "autograder" of a programming assignment.

    It holds the hidden cases of the `assignment` in a folder, and the rules of the class that
    stand in the table `adjustments`.
    """
    folder = Path(assignment).resolve()
    rules = read_adjustments(adjustments, load_assignment(folder), None) if adjustments else {}
    lines = [HEADER, *((CLASS, what, f"{line.value}", "") for (_, what), line in rules.items())]
    needed = re.compile(r"(numpy|scipy|tqdm)\b(?!.*extra ==)")
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
        archive.writestr(ADJUSTMENTS, "".join(f"{','.join(line)}\n" for line in lines))
        for source in sorted(PACKAGE.rglob("*")):
            lab = FOLDER in source.parents and source.suffix == ".json"  # the folder's instead
            if source.is_file() and "__pycache__" not in source.parts and not lab:
                archive.write(source, source.relative_to(PACKAGE.parent))
        for source in sorted(folder.rglob("*.json")):
            place = FOLDER.relative_to(PACKAGE.parent) / source.relative_to(folder)
            archive.write(source, place)


if __name__ == "__main__":
    grade_for_gradescope(Path(sys.argv[1]))
