"""Every submission ends in one verdict or one report of why not, whatever becomes of workers."""

import shutil
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.course.grading import store as stored
from labkit.course.grading.class_run import Graded, grade_class
from labkit.course.grading.contract import Limits
from labkit.course.grading.judging.verdict import QuestionVerdict, SubmissionVerdict
from labkit.course.grading.store import (
    Settings,
    VerdictStore,
    fingerprint,
    merge,
    still_to_grade,
)
from labkit.course.grading.submissions import Submission, find_submissions

SETTINGS = Settings(mode="none")


class KilledWorker(Exception):
    """What Dask raises, by its name."""


class Pool:
    """Grades by looking at the name; a deadly one breaks it, as a crash breaks a process pool."""

    def __init__(self, deadly=(), loss=BrokenProcessPool):
        self.deadly, self.loss, self.broken = deadly, loss, False

    def submit(self, grade, task, settings):
        if self.broken:
            raise self.loss("broken already")
        future = Future()
        if task.student in self.deadly:
            self.broken = self.loss is BrokenProcessPool
            future.set_exception(self.loss("gone"))
        elif task.student == "fault":
            future.set_exception(RuntimeError("a fault of the grader's"))
        else:
            future.set_result(Graded(student=task.student))
        return future


def named(names):
    return [Submission(student=name, name=name, files=()) for name in names]


@given(
    st.lists(st.sampled_from("abcdefgh"), unique=True, max_size=8),
    st.sets(st.sampled_from("abcdefgh")),
    st.sampled_from([BrokenProcessPool, KilledWorker]),
    st.integers(1, 4),
)
def test_a_lost_worker_costs_the_guilty_alone(names, deadly, loss, workers):
    pools = (Pool(deadly, loss) for _ in range(20))
    results = list(grade_class(named(names), SETTINGS, pools, workers=workers))
    assert sorted(one.student for one in results) == sorted(names)
    assert {one.student for one in results if one.failure} == deadly & set(names)


def test_a_fault_of_the_grader_is_told_and_the_batch_goes_on():
    pools = iter([Pool()])
    results = list(grade_class(named(["a", "fault", "b"]), SETTINGS, pools, workers=2))
    assert {one.student: one.failure for one in results} == {
        "a": "",
        "b": "",
        "fault": "RuntimeError: a fault of the grader's",
    }


def test_submissions_are_taken_no_faster_than_they_are_graded():
    taken = []

    def class_of_many():
        for one in named(str(k) for k in range(100)):
            taken.append(one.student)
            yield one

    pools = iter([Pool()])
    verdicts = grade_class(class_of_many(), SETTINGS, pools, workers=3)
    for done, _ in enumerate(verdicts, 1):
        assert len(taken) <= done + 2 * 3
    assert len(taken) == 100


def test_a_fingerprint_follows_from_all_that_a_verdict_follows_from(small, tmp_path, monkeypatch):
    files = {"a.py": b"x", "b.py": b"y"}
    settings = Settings(mode="none", assignment=str(small))
    other = shutil.copytree(small, tmp_path / "other")
    (other / "hidden/variant_1.json").unlink()
    marks = {
        fingerprint(files, settings),
        fingerprint({"a.py": b"xb", "b.py": b""}, settings),
        fingerprint({"a.py": b"x", "c.py": b"y"}, settings),
        fingerprint(files, replace(settings, mode="user")),
        fingerprint(files, replace(settings, limits=Limits(seconds=1.0))),
        fingerprint(files, replace(settings, assignment=str(other))),
    }
    assert len(marks) == 6
    assert fingerprint(dict(reversed(files.items())), settings) == fingerprint(files, settings)
    before = fingerprint(files, settings)
    for name in ("RULES", "FORMAT"):  # what an older labkit stored is graded again, and not read
        with monkeypatch.context() as newer:
            newer.setattr(stored, name, getattr(stored, name) + 1)
            assert fingerprint(files, settings) != before


def test_only_what_changed_is_graded_again(small, tmp_path):
    settings = Settings(mode="none", assignment=str(small))
    (tmp_path / "class").mkdir()
    for name in "abc":
        (tmp_path / "class" / f"{name}.py").write_text(f"x = '{name}'", encoding="utf-8")
    found = find_submissions(tmp_path / "class")
    with VerdictStore(tmp_path / "verdicts.jsonl") as store:
        for one in found[:2]:
            store.put(verdict(one.student), fingerprint(one.read()[0], settings))
        (tmp_path / "class/b.py").write_text("x = 'changed'", encoding="utf-8")

        def todo(*again):
            return [one.student for one in still_to_grade(found, store, settings, again)]

        assert todo() == ["b", "c"]
        assert todo("a") == ["a", "b", "c"]


def question(name, score):
    return QuestionVerdict(
        question=name, title=name, points=2.0, score=score, cases=(), misconception=None, message=""
    )


def verdict(student, *questions):
    return SubmissionVerdict(
        student=student, submission=student, mode="none", questions=questions,
        score=sum(one.score for one in questions), points=2.0 * len(questions), notes=(),
        seconds=0.0,
    )  # fmt: skip


def test_a_question_graded_again_takes_its_place():
    old = verdict("a", question("gate", 0.5), question("huber", 1.0), question("icp", 2.0))
    new = merge(old, verdict("a", question("huber", 2.0)))
    assert [(one.question, one.score) for one in new.questions] == [
        ("gate", 0.5),
        ("huber", 2.0),
        ("icp", 2.0),
    ]
    assert (new.score, new.points) == (pytest.approx(4.5), 6.0)
