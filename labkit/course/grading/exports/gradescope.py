"""Gradescope's results, its due dates, and the archive that grades there [1]_.

Each question is a test with its score; each of its hidden cases is one more, without points,
that only the instructors see. In the archive, ``setup.sh`` builds the image and
``run_autograder`` grades one submission in it.

References
----------
.. [1] Gradescope, "Autograder specifications".
"""

from __future__ import annotations

import json
import os
import re
import zipfile
from datetime import datetime
from importlib.metadata import requires
from pathlib import Path
from typing import Any

from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.feedback import question_text
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict
from labkit.course.grading.marks import ADJUSTMENTS, HEADER, read_rows
from labkit.errors import LabkitError
from labkit.files import atomic_write

MOST = 1500  # characters that a student is shown of one question


def gradescope_results(verdict: SubmissionVerdict) -> str:
    r"""The file that Gradescope reads from ``/autograder/results``.

    Examples
    --------
    >>> verdict = SubmissionVerdict(student="ada", submission="ada.py", mode="user",
    ...     questions=(), score=0.0, points=0.0, notes=("one note",), seconds=0.01)
    >>> results = json.loads(gradescope_results(verdict))
    >>> results["tests"], results["output"]
    ([], 'one note\n\nGraded in isolation: user.')
    """
    tests: list[dict[str, Any]] = []
    for place, question in enumerate(verdict.questions, 1):
        tests.append(_question(f"{place}", question))
        hidden = [case for case in question.cases if case.hidden]
        tests += [_hidden_case(f"{place}.{n}", question, case) for n, case in enumerate(hidden, 1)]
    results = {
        "score": round(verdict.score, 6),
        "execution_time": round(verdict.seconds, 3),
        "output": _cut("\n\n".join(verdict.remarks), f"Graded in isolation: {verdict.mode}."),
        "output_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": tests,
    }
    return json.dumps(results, indent=1, ensure_ascii=True, allow_nan=False)


def _question(number: str, question: QuestionVerdict) -> dict[str, Any]:
    return {
        "number": number,
        "name": question.title,
        "score": round(question.score, 6),
        "max_score": question.points,
        "status": "passed" if question.passed else "failed",
        "output": _cut(question_text(question, hidden=False)),
        "output_format": "text",
        "visibility": "visible",
        "tags": [question.question],
    }


def _cut(text: str, *more: str) -> str:
    """What fits: a student may hand in as often as Gradescope lets one, and read it each time."""
    shown = text if len(text) <= MOST else f"{text[:MOST]}…"
    return "\n\n".join(part for part in (shown, *more) if part)


def _hidden_case(number: str, question: QuestionVerdict, case: CaseVerdict) -> dict[str, Any]:
    return {
        "number": number,
        "name": f"{question.title}, hidden case {case.id}",
        "status": "passed" if case.passed else "failed",
        "output": case.reason,
        "output_format": "text",
        "visibility": "hidden",
        "tags": [question.question],
    }


HERE = Path(__file__).with_name("autograder")
PACKAGE = HERE.parents[3]
SCRIPTS = ("setup.sh", "run_autograder")
READER = "ipython>=8.20"  # as the extra "grading" has it, which also draws pages
COMMAND = "labkit_command.py"  # beside the package: what `python -m labkit` begins with
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same content gives the same bytes


def read_metadata(path: str | os.PathLike[str]) -> tuple[str, float]:
    """Who hands in, and how many days after the due date, as Gradescope says.

    Raises
    ------
    LabkitError
        Where the file is not Gradescope's ``submission_metadata.json``.
    """
    try:
        told = json.loads(Path(path).read_text(encoding="utf-8"))
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
    """Write the archive to upload as "autograder" of a programming assignment.

    Parameters
    ----------
    path : path-like
        The zip archive.
    assignment : path-like
        The folder of the assignment, with its hidden cases.
    adjustments : path-like, optional
        ``adjustments.csv``, of which the rules of the class hold there, too.

    Raises
    ------
    LabkitError
        Where the archive cannot be written, or the folder holds no assignment to grade by.
    """
    load_assignment(assignment)
    folder = Path(assignment).resolve()
    with atomic_write(path, "wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zip:
        for name in SCRIPTS:
            _add(zip, name, (HERE / name).read_bytes(), executable=True)
        _add(zip, "requirements.txt", "\n".join(_requirements()).encode() + b"\n")
        rules = [",".join(HEADER)]
        if adjustments:
            rows = read_rows(adjustments, HEADER[:3])
            rules += [
                f"*,{row['what']},{row['value']}," for _, row in rows if row["student"] == "*"
            ]
        _add(zip, ADJUSTMENTS, "\n".join(rules).encode() + b"\n")
        for source in [PACKAGE.with_name(COMMAND), *_package_files()]:
            _add(zip, source.relative_to(PACKAGE.parent).as_posix(), source.read_bytes())
        for source in sorted(folder.rglob("*.json")):
            name = f"labkit/{FOLDER.relative_to(PACKAGE).as_posix()}"
            _add(zip, f"{name}/{source.relative_to(folder).as_posix()}", source.read_bytes())


def _package_files() -> list[Path]:
    """All of labkit but compiled files and the lab's own cases, which give way to the folder's."""
    return sorted(
        file
        for file in PACKAGE.rglob("*")
        if file.is_file()
        and "__pycache__" not in file.parts
        and not (FOLDER in file.parents and file.suffix == ".json")
    )


def _add(archive: zipfile.ZipFile, name: str, data: bytes, *, executable: bool = False) -> None:
    info = zipfile.ZipInfo(name, EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = (0o100755 if executable else 0o100644) << 16
    archive.writestr(info, data)


def _requirements() -> list[str]:
    """What labkit itself needs, and the reader of notebooks; without its other extras."""
    declared = requires("labkit")
    if declared is None:
        raise LabkitError("labkit is not installed, so what it needs is not known; pip install it")
    return [*(line for line in declared if not re.search(r";.*extra\s*==", line)), READER]
