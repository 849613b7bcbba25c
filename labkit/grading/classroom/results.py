"""The results of a class: scores, pages, gradebooks, code and feedback, written together."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from labkit.grading.classroom.gradebooks import Gradebook, write_scores
from labkit.grading.classroom.handins import Submission
from labkit.grading.classroom.marks import (
    CLASS,
    Adjustments,
    Roster,
    make_group_marks,
    make_marks,
)
from labkit.grading.classroom.pages import student_page, write_pages
from labkit.grading.classroom.store import VERDICTS, Record, file_name
from labkit.grading.judge.verdict import SubmissionVerdict
from labkit.grading.questions import Assignment
from labkit.support.files import atomic_write

SHOWN = 5  # names in a message
WRITTEN = ("scores.csv", "canvas.csv", "moodle.csv", "index.html", "feedback.zip", "handed_out.py")
FOLDERS = ("code", "students", VERDICTS)


def written_files(out: Path) -> list[Path]:
    """The files in the folder of results that a run may write over."""
    return [out / name for name in WRITTEN] + [
        path for folder in FOLDERS for path in (out / folder).glob("*")
    ]


@dataclass(frozen=True, eq=False, kw_only=True)
class Results:
    """A class's results, which can be written again when there are more verdicts."""

    out: Path  # the folder that takes them
    assignment: Assignment
    roster: Roster
    adjustments: Adjustments
    books: Mapping[str, Gradebook]  # by the name of the file that is filled in
    submissions: Sequence[Submission]
    overwrite: bool = False  # of what stands in gradebooks

    def write(self, records: Mapping[str, Record], failures: Mapping[str, str]) -> list[str]:
        """Write all but those of the `failures`, which say why; remarks for the terminal."""
        marks = make_marks(records, self.adjustments, self.assignment, self.roster)
        present = {mark.student for mark in marks} | failures.keys()
        present |= {member for student in failures for member in self.roster.members(student)}
        missing = {id: name for id, name in self.roster.names.items() if id not in present}
        write_scores(marks, missing, self.out / "scores.csv")
        write_pages(self.out, marks, self.assignment, failures=failures, missing=missing)
        self._write_code(records)
        returned = [*marks, *make_group_marks(records, self.adjustments, self.roster)]
        self._pack_feedback(returned)
        return [
            *self._remarks(marks, missing),
            *self._fill_books(marks),
            *self._group_remarks(records),
        ]

    def _group_remarks(self, records: Mapping[str, Record]) -> Iterable[str]:
        """A remark on members of a group with hand-ins of their own."""
        replaced = [
            student
            for student, group in self.roster.groups.items()
            if student != group and {student, group} <= records.keys()
        ]
        if replaced:
            yield (
                f"{len(replaced)} handed in alone, and have the mark of the group in roster.csv: "
                f"{some(replaced)}"
            )

    def _remarks(
        self, marks: Sequence[SubmissionVerdict], missing: Mapping[str, str]
    ) -> Iterable[str]:
        """Remarks on who handed in nothing, what was not read, and points that people owe."""
        if missing:
            yield f"{len(missing)} of the roster handed in nothing: {some(missing.values())}"
        unread = [mark.student for mark in marks if mark.unread]
        if unread:
            yield (
                f"{len(unread)} handed in files that were not read: {some(unread)}. "
                f"{self.out}/index.html says why"
            )
        given = {student for student, item in self.adjustments if item == "written"}
        waiting = [mark.student for mark in marks if mark.student not in given]
        if CLASS in given and waiting:
            yield f"{len(waiting)} have no points for their written answers yet: {some(waiting)}"

    def _fill_books(self, marks: Sequence[SubmissionVerdict]) -> Iterable[str]:
        """Fill in the gradebooks; remarks on rows that are missing or hold something."""
        for name, book in self.books.items():
            unlisted, occupied = book.fill(marks, self.out / name, overwrite=self.overwrite)
            if unlisted:
                yield (
                    f"{len(unlisted)} have no row in the gradebook, nor in {name}: {some(unlisted)}"
                )
            if occupied:
                yield (
                    f"{len(occupied)} have a grade or a comment in the gradebook, so they have no "
                    f"row in {name}: {some(occupied)}. --overwrite gives them one"
                )

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
