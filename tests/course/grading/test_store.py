"""No verdict that was stored is lost, whatever happens afterwards."""

import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.course.grading.judging.verdict import CaseVerdict, QuestionVerdict, SubmissionVerdict
from labkit.course.grading.store import VerdictStore
from labkit.errors import LabkitError


def verdict(student, score=1.0, note="résumé ⌊ρN⌋"):
    case = CaseVerdict(id="1", hidden=True, credit=score, reason="no", misconception="squared")
    question = QuestionVerdict(
        question="gate", title="Gate", points=2.0, score=2.0 * score, cases=(case,),
        misconception=None, message="",
    )  # fmt: skip
    return SubmissionVerdict(
        student=student, submission=f"{student}.py", mode="landlock", questions=(question,),
        score=2.0 * score, points=2.0, notes=(note,), seconds=0.25,
    )  # fmt: skip


def stored(path):
    with VerdictStore(path) as store:
        return list(store)


@given(st.lists(st.tuples(st.sampled_from("abc"), st.floats(0, 1), st.text()), max_size=8))
def test_it_is_a_dictionary_that_survives(tmp_path_factory, entries):
    path = tmp_path_factory.mktemp("store") / "verdicts.jsonl"
    expected = {}
    for student, score, note in entries:
        expected[student] = verdict(student, score, note)
        with VerdictStore(path) as store:
            store.put(expected[student], fingerprint=note)
            assert store.fingerprint(student) == note
    assert stored(path) == [expected[student] for student in sorted(expected)]


def test_a_crash_at_any_byte_loses_at_most_the_last_verdict(tmp_path):
    path = tmp_path / "verdicts.jsonl"
    with VerdictStore(path) as store:
        for student in "abc":
            store.put(verdict(student), "1")
    whole = path.read_bytes()
    ends = [end + 1 for end, byte in enumerate(whole) if byte == ord("\n")]
    for cut in range(0, len(whole), 7):
        path.write_bytes(whole[:cut])
        kept = max(0, sum(end <= cut for end in ends) - 1)
        assert [one.student for one in stored(path)] == list("abc")[:kept]
        with VerdictStore(path) as store:
            store.put(verdict("d"), "1")
        assert [one.student for one in stored(path)] == [*"abc"[:kept], "d"]


def test_what_is_not_stored_has_no_fingerprint(tmp_path):
    with VerdictStore(tmp_path / "v.jsonl") as store:
        assert store.fingerprint("ada") is None
        assert "ada" not in store
        assert len(store) == 0


@pytest.mark.parametrize("content", [b"not ours\n", b"[1]\n", b"{}\n", b"\xff\xfe"])
def test_another_file_is_left_alone(tmp_path, content):
    path = tmp_path / "thesis.txt"
    path.write_bytes(content)
    with pytest.raises(LabkitError, match="is no file of stored verdicts; name another place"):
        VerdictStore(path)
    assert path.read_bytes() == content


def test_a_verdict_of_another_version_is_named_with_its_file(tmp_path):
    path = tmp_path / "v.jsonl"
    with VerdictStore(path) as store:
        store.put(verdict("ada"), "1")
    path.write_bytes(path.read_bytes().replace(b'"format": 2', b'"format": 1'))
    with pytest.raises(LabkitError, match=r"v\.jsonl: ada: the verdict has format 1"):
        stored(path)


def test_a_place_that_cannot_be_written(tmp_path):
    with pytest.raises(LabkitError, match=r"cannot write .*; choose another place"):
        VerdictStore(tmp_path)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such locks")
def test_two_graders_do_not_share_a_file(tmp_path):
    path = tmp_path / "v.jsonl"
    with VerdictStore(path) as store:
        store.put(verdict("ada"), "1")
        with pytest.raises(LabkitError, match="is in use by another `labkit grade`"):
            VerdictStore(path)
    assert [one.student for one in stored(path)] == ["ada"]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such locks")
def test_a_killed_grader_leaves_no_lock(tmp_path):
    code = (
        "import os, signal, sys; from labkit.course.grading.store import VerdictStore; "
        "store = VerdictStore(sys.argv[1]); os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "v.jsonl")], check=False)
    assert stored(tmp_path / "v.jsonl") == []
