"""What a box says is checked word by word."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small import FILES, FUNCTIONS

from labkit.course.grading.contract import Call, OutcomeStatus
from labkit.course.grading.sandbox.host.session import (
    MAX_MESSAGE,
    read_cell,
    read_extraction,
    read_outcome,
    readable,
)
from labkit.course.grading.sandbox.inside import data, worker
from labkit.course.grading.sandbox.inside.data import WireError

CALL = Call(id="7", question="q", function="f")
GOOD = {
    "id": "7", "turn": "t", "status": "RETURNED", "value": 1.0, "message": "", "error": "",
    "output": "", "seconds": 0.5,
}  # fmt: skip


def read(**changes):
    return read_outcome(GOOD | changes, CALL, "t", output_chars=10, elapsed=1.0)


def test_a_good_answer():
    outcome = read()
    assert (outcome.status, outcome.value, outcome.seconds) == (OutcomeStatus.RETURNED, 1.0, 0.5)


@pytest.mark.parametrize(
    "changes",
    [
        {"id": "8"},
        {"turn": ""},
        {"status": "TIMEOUT"},
        {"status": "KILLED"},
        {"status": "FULL_MARKS"},
        {"status": ("RETURNED",)},
        {"status": None},
    ],
)
def test_an_answer_out_of_turn_is_none(changes):
    with pytest.raises(WireError):
        read(**changes)


@pytest.mark.parametrize("frame", [None, 3.0, (), "RETURNED", {}])
def test_what_is_no_answer_is_none(frame):
    with pytest.raises(WireError):
        read_outcome(frame, CALL, "t", output_chars=10, elapsed=1.0)
    with pytest.raises(WireError):
        read_cell(frame, 0)


def test_what_is_missing_or_of_another_kind_is_left_out():
    outcome = read(value=2.0, message=5, output=None, seconds="fast", error=["x"], points=100)
    assert (outcome.message, outcome.output, outcome.error, outcome.seconds) == ("", "", "", 1.0)


@pytest.mark.parametrize(("said", "taken"), [(-5.0, 0.0), (99.0, 1.0), (float("nan"), 1.0)])
def test_time_is_bounded_by_the_grader_s_own_clock(said, taken):
    assert read(seconds=said).seconds == taken


def test_a_value_counts_with_returned_alone():
    assert read(status="RAISED", value=1.0).value is None


def test_only_built_in_names_of_errors_pass():
    assert read(error="ZeroDivisionError").error == "ZeroDivisionError"
    for name in ("Secret17", "print", "__name__", "ZeroDivisionError "):
        assert read(error=name).error == ""


def test_text_is_cut_and_cleaned():
    assert readable("x" * 10_000) == "x" * (MAX_MESSAGE - 1) + "…"
    assert readable("a\x00\x1b[2J\u202eb\r\n\u2028c") == "a[2Jb   c"
    assert read(output="1\n2\t3\x1b").output == "1\n2\t3"
    assert len(read(output="y" * 100).output) == 10


def test_a_cell_that_failed_says_so():
    assert read_cell({"cell": 2, "message": "", "error": ""}, 2) is None
    complaint = read_cell({"cell": 2, "message": "NameError: x", "error": "NameError"}, 2)
    assert (complaint.status, complaint.error) == (OutcomeStatus.SOURCE_FAILED, "NameError")
    with pytest.raises(WireError):
        read_cell({"cell": 1, "message": ""}, 2)


def frame_of(files):
    sent = {name: data.from_bytes(held) for name, held in files.items()}
    frame = data.pack(worker.found_in(sent, FUNCTIONS))
    return data.receive(io.BytesIO(frame).read, len(frame))[0]


VALUES = st.none() | st.integers() | st.text() | st.just(()) | st.just(np.zeros(2))


@given(st.sampled_from(sorted(frame_of(FILES))), VALUES | st.tuples(VALUES))
def test_a_forged_extraction_is_refused_or_read_as_data(name, value):
    frame = frame_of(FILES) | {name: value}
    try:
        found = read_extraction(frame, FUNCTIONS)
    except data.WireError:
        return
    assert all(isinstance(text, str) for text in (*found.notes, *found.unread))
    assert {cell.question for cell in found.cells} <= {None, "q"}
    assert all(isinstance(cell.label, str) for cell in found.cells)
    assert all(isinstance(one, int) for one in found.passages)
