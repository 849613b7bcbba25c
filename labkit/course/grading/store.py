"""The verdicts of a class on disk, one line each, and whether they still hold.

They are written as they come, so that an interruption loses none, and the file only grows. A
later line on the same student replaces an earlier one, and a last line that was cut off by a
crash is dropped, which costs that one submission. What people decide stands beside it, in
``adjustments.csv``; see `labkit.course.grading.marks`.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.contract import Limits
from labkit.course.grading.judging.verdict import FORMAT, SubmissionVerdict
from labkit.errors import LabkitError

RULES = 6  # raise it when the same files would get other points or messages than before
HEADER = json.dumps({"labkit verdicts": 2}).encode("ascii") + b"\n"
VERDICTS = "verdicts.jsonl"


class VerdictStore:
    """The verdicts of a class, by student; a context manager.

    Parameters
    ----------
    folder : path-like
        Where the file is; made if it does not exist, for its owner alone.

    Raises
    ------
    LabkitError
        Where the file cannot be written, is no store of verdicts, or is in use by another
        grader.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> verdict = SubmissionVerdict(student="ada", submission="ada.py", mode="none",
    ...     questions=(), score=0.0, points=0.0, notes=(), seconds=0.01)
    >>> with TemporaryDirectory() as folder, VerdictStore(folder) as store:
    ...     store.put(verdict, "1f", late=2.0)
    ...     store.students, store.fingerprint("ada"), store.late("ada"), store["ada"] == verdict
    (['ada'], '1f', 2.0, True)
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.path = Path(folder) / VERDICTS
        self._entries: dict[str, dict[str, Any]] = {}
        try:
            self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            number = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o600)
        except OSError as error:
            raise LabkitError(
                f"cannot write {self.path}: {error.strerror}; choose another place"
            ) from None
        self._file = os.fdopen(number, "r+b", buffering=0)
        try:
            _lock(number, self.path)
            self._read()
        except BaseException:
            self._file.close()
            raise

    def put(self, verdict: SubmissionVerdict, fingerprint: str, late: float = 0.0) -> None:
        """Add a verdict, or replace the one on the same student."""
        fields = json.loads(json.dumps(verdict.fields, allow_nan=False, default=vars))
        self._write(verdict.student, fingerprint=fingerprint, late=late, verdict=fields)

    def set_late(self, student: str, late: float) -> None:
        """Note what the platform says now of how late a student was [days]."""
        if student in self._entries and late != self.late(student):
            self._write(student, **{**self._entries[student], "late": late})

    def fingerprint(self, student: str) -> str:
        """What the stored verdict was graded from; empty where there is no verdict."""
        return str(self._entries.get(student, {}).get("fingerprint", ""))

    def late(self, student: str) -> float:
        """How late the platform says that a student was [days]."""
        return float(self._entries[student]["late"])

    @property
    def students(self) -> list[str]:
        """All who have a verdict, in alphabetical order."""
        return sorted(self._entries)

    def __getitem__(self, student: str) -> SubmissionVerdict:
        fields = self._entries[student]["verdict"]
        try:
            return SubmissionVerdict.from_fields(json.loads(json.dumps(fields)))
        except LabkitError as error:
            raise LabkitError(f"{self.path}: {student}: {error}") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

    def _write(self, student: str, **entry: Any) -> None:
        line = json.dumps({"student": student, **entry}, allow_nan=False).encode("ascii") + b"\n"
        end = os.fstat(self._file.fileno()).st_size
        try:
            if self._file.write(line) < len(line):
                raise OSError(28, "no space left on device")
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(end)
            raise LabkitError(
                f"cannot write {self.path}: {error.strerror}; all verdicts until now are in it: "
                f"make room, and run the same command again"
            ) from None
        self._entries[student] = entry

    def _read(self) -> None:
        """Take in all whole lines, and cut off what follows them."""
        self._file.seek(0)
        content = self._file.read()
        if content and not content.startswith(HEADER[: len(content)]):
            raise LabkitError(
                f"{self.path} is no store of verdicts of this labkit; choose another --out"
            )
        whole = content[: content.rfind(b"\n") + 1]
        for number, line in enumerate(whole.splitlines()[1:], 2):
            try:
                entry = json.loads(line)
                self._entries[entry.pop("student")] = entry
            except (ValueError, TypeError, KeyError, AttributeError):
                raise LabkitError(
                    f"{self.path}: line {number} is damaged; take it out, and run again"
                ) from None
        self._file.truncate(len(whole))
        if not whole:
            self._file.write(HEADER)


def fingerprint(
    files: Mapping[str, bytes], assignment: Assignment, limits: Limits, mode: str
) -> str:
    """A digest of all that a verdict follows from: files, assignment, limits, wall, rules."""
    digest = hashlib.sha256(f"{assignment.digest} {limits} {mode} {RULES} {FORMAT}".encode())
    for name in sorted(files):
        digest.update(json.dumps([name, len(files[name])]).encode())
        digest.update(files[name])
    return digest.hexdigest()[:32]


def _lock(number: int, path: Path) -> None:
    """Keep other graders out until this process ends, however it ends."""
    try:
        fcntl = importlib.import_module("fcntl")
    except ImportError:  # Windows: two graders on one file are the instructor's care
        return
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise LabkitError(
            f"{path} is in use by another `labkit grade`; wait for it, or grade elsewhere"
        ) from None
