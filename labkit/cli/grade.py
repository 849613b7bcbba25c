"""``labkit grade``: submissions in, verdicts, pages and gradebooks out."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

from tqdm import tqdm

from labkit.arrays import check_count
from labkit.cli.grade_outputs import Results, add_output_options, check_outputs, write_outputs
from labkit.course.grading.assignment import FOLDER, load_assignment
from labkit.course.grading.assignment.files import folder_of
from labkit.course.grading.assignment.questions import Assignment
from labkit.course.grading.class_run import (
    Graded,
    cluster_executors,
    grade_class,
    local_pools,
    open_sandboxes,
    prepare,
)
from labkit.course.grading.contract import Limits
from labkit.course.grading.sandbox.host import SAFE, open_sandbox
from labkit.course.grading.store import Settings, VerdictStore, merge, still_to_grade
from labkit.course.grading.submissions import Submission, find_submissions, one_submission
from labkit.course.grading.submissions.find import VERDICTS
from labkit.errors import InvalidParameterError, LabkitError

Where = tuple[Iterator[Executor], int]  # what grades, and how many at a time

PUBLIC = """\
the hidden cases are the public ones, which anybody can compute; draw your own with
`python -m labkit.course.authoring --secret FILE`, and grade with --secret FILE"""
DESCRIPTION = """\
Grade notebooks (.ipynb) and scripts (.py). SUBMISSIONS is one file; a folder or zip archive
with a file or folder for each student; or a bulk download of Canvas, Moodle or nbgrader.

Students' code runs in isolation: no network, no other submission, no reference, limits on
time, memory and output. Each verdict is stored in OUT/verdicts.jsonl as it comes: run the
same command again after an interruption, or after new submissions, and it goes on."""


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``grade`` to the command line."""
    parser = commands.add_parser(
        "grade",
        help="grade submissions in isolation",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("submissions", metavar="SUBMISSIONS", help="a file, folder or zip archive")
    parser.add_argument(
        "--student", metavar="NAME", help="all of SUBMISSIONS is the work of one student, NAME"
    )
    parser.add_argument(
        "--within",
        metavar="FOLDER",
        default="",
        help="the folder in each student's that is graded, as of one of nbgrader's assignments",
    )
    parser.add_argument(
        "--assignment", metavar="FOLDER", default=str(FOLDER), help="questions (the lab's own)"
    )
    parser.add_argument(
        "--secret", metavar="FILE", help="hidden cases drawn from the course's secret in FILE"
    )
    parser.add_argument(
        "--again", nargs="+", default=[], metavar="STUDENT", help="grade these once more"
    )
    parser.add_argument(
        "--question",
        nargs="+",
        default=[],
        metavar="ID",
        help="grade these questions once more, of all or of those named by --again",
    )
    where = parser.add_argument_group("where the code runs")
    where.add_argument("--mode", choices=("auto", *SAFE), default="auto", help="(auto: strongest)")
    where.add_argument(
        "--no-isolation",
        action="store_true",
        help="limits alone, which is NOT SAFE: only for code that you trust",
    )
    where.add_argument(
        "--seconds",
        type=float,
        default=Limits().seconds,
        metavar="S",
        help="for a question (%(default)s)",
    )
    where.add_argument("--jobs", type=int, metavar="N", help="how many at a time (all cores)")
    where.add_argument("--cluster", metavar="ADDRESS", help="grade on a running Dask cluster")
    add_output_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Grade what has no verdict yet; status 1 where a submission could not be graded."""
    workers = _cores() if args.jobs is None else args.jobs
    check_count(workers, "jobs", at_least=1)
    if not args.cluster:
        prepare()
    if args.secret:
        args.assignment = str(folder_of(args.secret))
    assignment = load_assignment(args.assignment)
    for id in args.question:
        assignment.question(id)
    submissions = _submissions(args)
    check_outputs(args, len(submissions), assignment)
    if assignment.public:
        print(f"labkit grade: {PUBLIC}", file=sys.stderr)
    with _where(min(workers, len(submissions)), args.cluster) as where:
        return _grade(args, submissions, assignment, where)


def _cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _grade(
    args: argparse.Namespace,
    submissions: Sequence[Submission],
    assignment: Assignment,
    where: Where,
) -> int:
    limits = Limits(seconds=args.seconds)
    mode, where = _mode(args, limits, where)
    settings = Settings(mode=mode, limits=limits, assignment=args.assignment)
    with VerdictStore(_folder(args.out) / VERDICTS) as store:
        again = _known(submissions, args.again)
        todo = still_to_grade(submissions, store, settings, () if args.question else again)
        failures: dict[str, str] = {}
        jobs = [(todo, settings)]
        if args.question:
            listed = {one.student for one in todo}
            rest = [
                one
                for one in submissions
                if one.student not in listed and (not again or one.student in again)
            ]
            jobs.append((rest, replace(settings, questions=tuple(args.question))))
        for part, how in jobs:
            for graded in _graded(part, how, where, by_value=args.cluster is not None):
                _keep(graded, store, failures, partial=bool(how.questions))
        results = Results(
            store=store,
            assignment=assignment,
            submissions=submissions,
            failures=failures,
            mode=mode,
        )
        write_outputs(args, results)
        asked = sum(len(part) for part, _ in jobs)
        print(_closing(len(submissions), asked, len(failures), settings.mode, args.out))
    for student, why in failures.items():
        print(f"labkit grade: {student} was not graded: {why}", file=sys.stderr)
    return 1 if failures else 0


def _submissions(args: argparse.Namespace) -> list[Submission]:
    remarks: list[str] = []
    try:
        if args.student:
            return [one_submission(args.submissions, args.student)]
        found = find_submissions(args.submissions, remarks, out=args.out, within=args.within)
    except OSError as error:  # a folder on the way that may not be entered, a name too long
        raise LabkitError(f"{args.submissions}: cannot be read: {error.strerror}") from None
    for remark in remarks:
        print(f"labkit grade: {remark}", file=sys.stderr)
    return found


def _mode(args: argparse.Namespace, limits: Limits, where: Where) -> tuple[str, Where]:
    """The isolation by its name, tried before any student's code is run; by workers of here."""
    if args.no_isolation:
        if args.mode != "auto":
            raise InvalidParameterError(
                f"cannot go with --mode {args.mode}; leave one of them out",
                parameter="no_isolation",
            )
        print(
            "labkit grade: no isolation: the code can read and write all that you can",
            file=sys.stderr,
        )
        return "none", where
    executors, count = where
    if args.cluster:
        with open_sandbox(args.mode) as sandbox:
            return sandbox.mode, where
    executor = next(executors)
    mode = open_sandboxes(executor, count, args.mode, limits, args.assignment)
    return mode, (chain([executor], executors), count)


def _known(submissions: Sequence[Submission], again: Sequence[str]) -> set[str]:
    students = {one.student for one in submissions}
    for name in again:
        if name not in students:
            shown = ", ".join(sorted(students)[:5]) + (", ..." if len(students) > 5 else "")
            raise InvalidParameterError(
                f"must name students ({shown}), got {name!r}", parameter="again"
            )
    return set(again)


def _folder(out: str) -> Path:
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LabkitError(f"cannot write {out}: {error.strerror}; choose another place") from None
    return folder


def _graded(
    part: Sequence[Submission], settings: Settings, where: Where, *, by_value: bool
) -> Iterator[Graded]:
    """The verdicts as they come, with a progress bar."""
    if part:
        executors, count = where
        verdicts = grade_class(part, settings, executors, workers=count, by_value=by_value)
        yield from tqdm(verdicts, total=len(part), unit="submission", disable=None)


@contextmanager
def _where(workers: int, cluster: str | None) -> Iterator[Where]:
    if cluster:
        with cluster_executors(cluster) as found:
            yield found
    else:
        with local_pools(workers) as pools:
            yield pools, workers


def _keep(graded: Graded, store: VerdictStore, failures: dict[str, str], *, partial: bool) -> None:
    """Store a verdict; a partial one, on some questions, takes their places in the stored one."""
    if graded.verdict is None:
        failures[graded.student] = graded.failure
        return
    verdict = graded.verdict
    if partial and graded.student in store:
        verdict = merge(store[graded.student], verdict)
    store.put(verdict, graded.fingerprint, graded.passages)


def _closing(found: int, asked: int, failed: int, mode: str, out: str) -> str:
    before = f", {found - asked} had their verdicts already" if asked < found else ""
    return f"{asked - failed} of {found} submissions graded (isolation: {mode}){before}; see {out}"
