"""The results of a class: scores, pages, gradebooks, code and feedback, written together."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from labkit.grading.classroom.gradebooks import write_scores
from labkit.grading.classroom.handins import Submission
from labkit.grading.classroom.marks import (
    BY_HAND,
    EXCUSED,
    Adjustments,
    Roster,
    make_group_marks,
    make_marks,
)
from labkit.grading.classroom.pages import student_page, write_pages, write_reading
from labkit.grading.classroom.platforms import GRADEBOOKS, Book
from labkit.grading.classroom.store import VERDICTS, Record, file_name
from labkit.grading.judge.verdict import SubmissionVerdict
from labkit.grading.questions import Assignment
from labkit.support.files import atomic_write

SHOWN = 5  # names in a message
WRITTEN = ("scores.csv", "index.html", "reading.html", "feedback.zip", "handed_out.py")
FOLDERS = ("code", "students", VERDICTS)


def written_files(out: Path) -> list[Path]:
    """The files in the folder of results that a run may write over."""
    names = [*WRITTEN, *(platform.returned for platform in GRADEBOOKS.values())]
    in_folders = [path for folder in FOLDERS for path in (out / folder).glob("*")]
    return [out / name for name in names] + in_folders


class Remark(NamedTuple):
    """A remark on some students, for the terminal and for the row of each."""

    says: str  # as "handed in nothing": of one or of many
    students: Sequence[str]
    way_out: str = ""

    def line(self, names: Mapping[str, str]) -> str:
        """The line for the terminal, with the `names` for a person."""
        line = f"{len(self.students)} {self.says}: "
        line += some(names.get(student, student) for student in self.students)
        return f"{line}. {self.way_out}" if self.way_out else line


@dataclass(frozen=True, eq=False, kw_only=True)
class Results:
    """A class's results, which can be written again when there are more verdicts."""

    out: Path  # the folder that takes them
    assignment: Assignment
    roster: Roster
    adjustments: Adjustments
    books: Mapping[str, Book]  # by the name of the file that is filled in
    submissions: Sequence[Submission]
    overwrite: bool = False  # of what stands in gradebooks
    is_class: bool = True  # and not one file, whose results stand beside those of a class

    def write(self, records: Mapping[str, Record], failures: Mapping[str, str]) -> list[str]:
        """Write all but those of the `failures`, which say why; remarks for the terminal."""
        marks = make_marks(records, self.adjustments, self.assignment, self.roster)
        present = {mark.student for mark in marks} | failures.keys()
        present |= {member for student in failures for member in self.roster.members(student)}
        missing = {id: name for id, name in self.roster.names.items() if id not in present}
        remarks = [
            *self._remarks(marks, missing, records),
            *self._fill_books(marks),
        ]
        by_student: dict[str, list[str]] = {}
        for remark in remarks:
            for student in remark.students:
                by_student.setdefault(student, []).append(remark.says)
        write_scores(marks, missing, self.out / "scores.csv", by_student)
        write_pages(self.out, marks, self.assignment, failures=failures, missing=missing)
        write_reading(self.out, records, self.adjustments, self.assignment, self.roster)
        self._write_code(records)
        returned = [*marks, *make_group_marks(records, self.adjustments, self.roster)]
        self._pack_feedback(returned)
        names = {mark.student: mark.submission for mark in marks} | dict(self.roster.names)
        return [remark.line(names) for remark in remarks if remark.students]

    def _remarks(
        self,
        marks: Sequence[SubmissionVerdict],
        missing: Mapping[str, str],
        records: Mapping[str, Record],
    ) -> Iterator[Remark]:
        """Remarks on who handed in nothing, what was not read, and points that people owe."""
        yield Remark("handed in nothing", list(missing))
        unread = [mark.student for mark in marks if mark.unread]
        yield Remark(
            "handed in files that were not read", unread, f"{self.out}/index.html says why"
        )
        yield Remark(
            "got no points for written answers yet, and so no row in a gradebook",
            [mark.student for mark in marks if mark.is_waiting],
            f"Give them in {self.out}/reading.html, or say {EXCUSED!r} in {self.out}/{BY_HAND}",
        )
        yield Remark(
            "handed in alone, and got the mark of the group in roster.csv",
            [
                student
                for student, group in self.roster.groups.items()
                if student != group and {student, group} <= records.keys()
            ],
        )
        if self.roster.is_listed:
            known = self.roster.names.keys() | set(self.roster.groups.values())
            yield Remark(
                f"handed in without a line in {self.out}/roster.csv",
                sorted(records.keys() - known),
                "Correct the table; a spreadsheet may have dropped zeros at the front",
            )
        if self.is_class:
            present = {submission.student for submission in self.submissions}
            yield Remark(
                "kept the results of an earlier run, and handed in nothing to this one",
                sorted(records.keys() - present),
                f"Remove their files in {self.out}/{VERDICTS}, or choose another --out",
            )

    def _fill_books(self, marks: Sequence[SubmissionVerdict]) -> Iterator[Remark]:
        """Fill in the gradebooks; remarks on rows that are missing or hold something."""
        ready = [mark for mark in marks if not mark.is_waiting]
        for name, book in self.books.items():
            unlisted, occupied, locked = book.fill(ready, self.out / name, overwrite=self.overwrite)
            yield Remark(f"got no row in {name}, as the gradebook has none", unlisted)
            yield Remark(
                f"got no row in {name}, as the gradebook holds a grade or a comment",
                occupied,
                "--overwrite gives them one",
            )
            yield Remark(f"got no row in {name}, as Moodle has locked the grade", locked)

    def _write_code(self, records: Mapping[str, Record]) -> None:
        """Write all that was handed in, and what was handed out, for tools that look for copies."""
        (self.out / "code").mkdir(exist_ok=True)
        sources = {f"code/{file_name(id)}.py": record.code for id, record in records.items()}
        stubs = [question.stub for question in self.assignment.questions]
        sources["handed_out.py"] = "\n\n\n".join(stubs) + "\n"
        for name, source in sources.items():
            with atomic_write(self.out / name) as file:
                file.write(source)

    def _pack_feedback(self, marks: Iterable[SubmissionVerdict]) -> None:
        """Pack the pages under the names by which Canvas and Moodle take files back."""
        by_student = {mark.student: mark for mark in marks}
        with (
            atomic_write(self.out / "feedback.zip", "wb") as file,
            zipfile.ZipFile(file, "w") as archive,
        ):
            for submission in self.submissions:
                if mark := by_student.get(submission.student):
                    name = submission.feedback_name or f"{file_name(mark.student)}.html"
                    archive.writestr(name, student_page(mark, self.assignment))


def some(names: Iterable[str]) -> str:
    """A few names, and whether there are more."""
    listed = list(names)
    return "; ".join(listed[:SHOWN]) + ("; ..." if len(listed) > SHOWN else "")
