"""Store of the verdicts: a file of JSON for each submission in ``verdicts/``, written whole.

So an interruption or a full disk costs no verdict that is there already, and the same command
goes on. What people decide stands in ``adjustments.csv``; see `labkit.grading.classroom.marks`.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labkit.grading.box.outside import Wall
from labkit.grading.judge.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict
from labkit.grading.questions import Assignment
from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write

RULES = 23  # raise it when the same files would get other points or messages than before
VERDICTS = "verdicts"


@dataclass(frozen=True, kw_only=True)
class Record:
    """The record of one submission."""

    verdict: SubmissionVerdict  # as the machine gave it
    fingerprint: str  # what the verdict follows from
    code: str  # all that was handed in
    written: str = ""  # answers in Markdown
    late: float = 0.0  # days, as the platform says
    is_public: bool = True  # by hidden cases that anybody can compute


def read_records(out: str | os.PathLike[str]) -> dict[str, Record]:
    """The records of a class, by student; the folder is made where there is none."""
    folder = Path(out) / VERDICTS
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise LabkitError(
            f"cannot write {folder}: {error.strerror}; choose another --out"
        ) from None
    records = {}
    for path in sorted(folder.glob("*.json")):
        try:
            record: Record = json.loads(path.read_text("utf-8"), object_hook=_restore)
            records[record.verdict.student] = record
        except (ValueError, TypeError, AttributeError) as error:
            raise LabkitError(
                f"{path}: is damaged or from another labkit version ({error}); delete it and "
                f"run again"
            ) from None
    return records


def _restore(fields: dict[str, Any]) -> object:
    """The object of which JSON holds the fields."""
    kinds = {"reason": CaseVerdict, "cases": QuestionVerdict, "questions": SubmissionVerdict}
    kind = next((kinds[name] for name in kinds if name in fields), Record)
    for name, value in fields.items():
        fields[name] = tuple(value) if isinstance(value, list) else value
    return kind(**fields)


def write_record(out: str | os.PathLike[str], record: Record) -> None:
    """Store a record; it replaces the one of the same student."""
    with atomic_write(Path(out) / VERDICTS / f"{file_name(record.verdict.student)}.json") as file:
        file.write(json.dumps(record, default=vars))


def file_name(student: str) -> str:
    """A student's name as that of a file: none leads out of the folder, no two are alike.

    >>> file_name("ada"), file_name("../Ada L")
    ('ada', 'Ada-L+9f6c9bbe')
    """
    plain = re.sub(r"[^a-z0-9_-]+", "-", student, flags=re.IGNORECASE).strip("-")[:60]
    if plain != student or student != student.lower():
        plain += f"+{hashlib.sha256(student.encode()).hexdigest()[:8]}"  # no plain name has a +
    return plain


def fingerprint(files: Mapping[str, bytes], assignment: Assignment, wall: Wall) -> str:
    """A digest of all that a verdict follows from: files, assignment, wall, rules."""
    head = f"{assignment.digest} {wall.mode} {wall.seconds} {RULES}"
    digest = hashlib.sha256(head.encode())
    for name in sorted(files):
        digest.update(json.dumps([name, len(files[name])]).encode())
        digest.update(files[name])
    return digest.hexdigest()[:32]
