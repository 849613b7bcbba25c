"""Verdicts as test reports: for Gradescope and its autograder [1]_, and JUnit's for integration.

For Gradescope each question is a test with its score; each of its hidden cases is one more,
without points, that only the instructors see. In the autograder's archive, ``setup.sh`` builds
the image and ``run_autograder`` grades one submission in it. In JUnit's XML a submission is a
suite, and a question is a case.

References
----------
.. [1] Gradescope, "Autograder specifications".
"""

from __future__ import annotations

import json
import os
import re
import zipfile
from collections.abc import Iterable
from importlib.metadata import requires
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.feedback import number, question_text
from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict
from labkit.errors import LabkitError
from labkit.files import atomic_write

MOST = 1500  # characters that a student is shown of one question
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


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
COMMAND = "labkit_command.py"  # beside the package: what `python -m labkit` begins with
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same content gives the same bytes


def write_autograder(
    path: str | os.PathLike[str], assignment: str | os.PathLike[str] = FOLDER
) -> None:
    """Write the archive to upload as "autograder" of a programming assignment.

    Parameters
    ----------
    path : path-like
        The zip archive.
    assignment : path-like
        The folder of the assignment, with its hidden cases.

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
    """What labkit itself needs, without its optional extras."""
    declared = requires("labkit")
    if declared is None:
        raise LabkitError("labkit is not installed, so what it needs is not known; pip install it")
    return [line for line in declared if not re.search(r";.*extra\s*==", line)]


def write_junit(verdicts: Iterable[SubmissionVerdict], out: str | os.PathLike[str]) -> None:
    """Write the verdicts as they come; a question without all its points is a failure."""
    with atomic_write(out, "wb") as file:
        file.write(b'<?xml version="1.0" encoding="utf-8"?>\n<testsuites>\n')
        for verdict in verdicts:
            file.write(ET.tostring(_suite(verdict), encoding="utf-8") + b"\n")
        file.write(b"</testsuites>\n")


def _suite(verdict: SubmissionVerdict) -> ET.Element:
    failed = sum(not question.passed for question in verdict.questions)
    suite = ET.Element(
        "testsuite",
        name=_text(verdict.student),
        tests=str(len(verdict.questions)),
        failures=str(failed),
        errors="0",
        skipped="0",
        time=f"{verdict.seconds:.3f}",
    )
    for question in verdict.questions:
        case = ET.SubElement(
            suite, "testcase", classname=_text(verdict.student), name=question.title
        )
        if not question.passed:
            score = f"{number(question.score)} of {number(question.points)} points"
            failure = ET.SubElement(case, "failure", message=score)
            failure.text = _text(question_text(question))
    if verdict.remarks:
        ET.SubElement(suite, "system-out").text = _text("\n".join(verdict.remarks))
    return suite


def _text(text: str) -> str:
    """Text without the characters that XML cannot hold."""
    return _NOT_XML.sub("\N{REPLACEMENT CHARACTER}", text)
