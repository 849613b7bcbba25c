"""Verdicts on disk, one line each, and whether they still hold.

They are written as they come, so that an interruption loses none, and the file only grows. A
later verdict on the same student replaces an earlier one, and a last line that was cut off by a
crash is dropped, which costs that one submission.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.contract import Limits
from labkit.course.grading.judging.verdict import FORMAT, SubmissionVerdict
from labkit.course.grading.submissions import Submission
from labkit.errors import LabkitError

RULES = 5  # raise it when the same files would get other points or messages than before
HEADER = {"labkit verdicts": 1}
HEADER_LINE = json.dumps(HEADER).encode("ascii") + b"\n"


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What makes two verdicts on the same files comparable.

    Attributes
    ----------
    mode : str
        The isolation, by the name that `labkit.course.grading.sandbox.host` gives it.
    limits : Limits
        What a submission may use.
    assignment : str
        The folder of the assignment.
    questions : tuple of str
        The questions to grade; empty for all of them.
    """

    mode: str
    limits: Limits = field(default_factory=Limits)
    assignment: str = str(FOLDER)
    questions: tuple[str, ...] = ()

    @property
    def functions(self) -> list[str]:
        """The names of the functions that the assignment asks for."""
        return [one.function for one in load_assignment(self.assignment).questions]

    @property
    def digest(self) -> str:
        """A digest of the assignment, the isolation, the limits and the grader's own rules."""
        own = f"{RULES} {FORMAT}"
        return f"{load_assignment(self.assignment).digest} {self.mode} {self.limits!r} {own}"


class VerdictStore:
    """The verdicts of a class, by student; a context manager.

    Holds in memory where each one stands in the file, and nothing of them.

    Parameters
    ----------
    path : path-like
        The file; made if it does not exist.

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
    >>> with TemporaryDirectory() as folder, VerdictStore(Path(folder, "v.jsonl")) as store:
    ...     store.put(verdict, fingerprint="1f", passages=(7, 9))
    ...     "ada" in store, store.fingerprint("ada"), store["ada"] == verdict
    (True, '1f', True)
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._place: dict[str, tuple[int, int, str]] = {}  # student: start, length, fingerprint
        try:
            self._file = open(self.path, "a+b")  # noqa: SIM115 (closed by `close`)
        except OSError as error:
            raise LabkitError(
                f"cannot write {self.path}: {error.strerror}; choose another place"
            ) from None
        try:
            _lock(self._file.fileno(), self.path)
            self._read_places()
        except BaseException:
            self._file.close()
            raise

    def put(
        self, verdict: SubmissionVerdict, fingerprint: str, passages: Sequence[int] = ()
    ) -> None:
        """Add a verdict, or replace the one on the same student.

        Parameters
        ----------
        verdict : SubmissionVerdict
            What to keep.
        fingerprint : str
            What it was graded from; `fingerprint` gives it back.
        passages : sequence of int
            Marks of its code, for `labkit.course.grading.similarity`.
        """
        entry = {
            "student": verdict.student,
            "fingerprint": fingerprint,
            "passages": list(passages),
            "verdict": verdict.fields,
        }
        line = json.dumps(entry, allow_nan=False, default=vars).encode("ascii") + b"\n"
        start = self._file.seek(0, os.SEEK_END)
        self._file.write(line)
        self._file.flush()
        self._place[verdict.student] = start, len(line), fingerprint

    def fingerprint(self, student: str) -> str | None:
        """What the stored verdict was graded from; None where there is no verdict."""
        place = self._place.get(student)
        return place[2] if place else None

    def passages(self) -> dict[str, tuple[int, ...]]:
        """The marks of every submission's code, by student."""
        return {student: tuple(self._entry(student)["passages"]) for student in sorted(self._place)}

    @property
    def students(self) -> list[str]:
        """All who have a verdict, in alphabetical order."""
        return sorted(self._place)

    def __getitem__(self, student: str) -> SubmissionVerdict:
        try:
            return SubmissionVerdict.from_fields(self._entry(student)["verdict"])
        except LabkitError as error:
            raise LabkitError(f"{self.path}: {student}: {error}") from None

    def __contains__(self, student: str) -> bool:
        return student in self._place

    def __len__(self) -> int:
        return len(self._place)

    def __iter__(self) -> Iterator[SubmissionVerdict]:
        """The verdicts by student, each read when its turn comes."""
        return (self[student] for student in sorted(self._place))

    def close(self) -> None:
        """Make sure that all is on the disk, and let others at the file."""
        with suppress(ValueError, OSError):
            self._file.flush()
            os.fsync(self._file.fileno())
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _entry(self, student: str) -> dict[str, Any]:
        start, length, _ = self._place[student]
        self._file.seek(start)
        entry: dict[str, Any] = json.loads(self._file.read(length))
        return entry

    def _read_places(self) -> None:
        """Find every whole line; take off a cut one at the end."""
        self._file.seek(0)
        start = 0
        for line in self._file:
            entry = _parsed(line)
            if start == 0 and entry != HEADER and not HEADER_LINE.startswith(line):
                raise LabkitError(
                    f"{self.path} is no file of stored verdicts; name another place for them"
                )
            if entry is None:
                break  # a crash cut it off, and nothing whole can follow
            if "student" in entry:
                self._place[entry["student"]] = start, len(line), entry["fingerprint"]
            start += len(line)
        self._file.truncate(start)
        if start == 0:
            self._file.write(HEADER_LINE)
            self._file.flush()


def fingerprint(files: Mapping[str, bytes], settings: Settings) -> str:
    """A digest of all that a verdict follows from: files, assignment, isolation, limits, rules."""
    digest = hashlib.sha256(settings.digest.encode())
    for name in sorted(files):
        digest.update(json.dumps([name, len(files[name])]).encode())
        digest.update(files[name])
    return digest.hexdigest()[:32]


def merge(old: SubmissionVerdict, new: SubmissionVerdict) -> SubmissionVerdict:
    """The old verdict with the questions of a partial, newer one in their places."""
    fresh = {verdict.question: verdict for verdict in new.questions}
    questions = tuple(fresh.get(verdict.question, verdict) for verdict in old.questions)
    score = round(sum(verdict.score for verdict in questions), 2)
    return replace(new, questions=questions, score=score, points=old.points)


def still_to_grade(
    submissions: Iterable[Submission],
    store: VerdictStore,
    settings: Settings,
    again: Collection[str] = (),
) -> list[Submission]:
    """Those without a stored verdict on the same files, and those that are asked for again."""
    return [
        one
        for one in submissions
        if one.student in again
        or one.student not in store
        or store.fingerprint(one.student)
        != fingerprint(one.read(settings.functions).files, settings)
    ]


def _parsed(line: bytes) -> dict[str, Any] | None:
    """The object on a whole line; None where the line is cut off or holds something else."""
    if not line.endswith(b"\n"):
        return None
    with suppress(ValueError):
        entry = json.loads(line)
        if isinstance(entry, dict):
            return entry
    return None


def _lock(descriptor: int, path: Path) -> None:
    """Keep other graders out until this process ends, however it ends."""
    try:
        fcntl = importlib.import_module("fcntl")
    except ImportError:  # Windows: two graders on one file are the instructor's care
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise LabkitError(
            f"{path} is in use by another `labkit grade`; wait for it, or grade elsewhere"
        ) from None
