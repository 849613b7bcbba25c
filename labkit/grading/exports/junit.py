"""JUnit XML: what continuous integration reads. A suite a submission, a case a question."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from xml.etree import ElementTree as ET

from labkit.files import atomic_write
from labkit.grading.exports.feedback import number, question_text
from labkit.grading.judging.verdict import SubmissionVerdict

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


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
