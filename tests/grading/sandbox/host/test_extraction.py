"""What a student handed in is read in the box: a parser that hangs or dies costs one submission."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.grading.contract import Call, Limits, OutcomeStatus
from labkit.grading.extraction import extract
from labkit.grading.sandbox.host import extraction
from labkit.grading.sandbox.inside import data, worker

FUNCTIONS = {"q": "double"}
SOURCE = "import math\n\ndef double(x):\n    return 2 * x\n"
FILES = {
    "a.py": SOURCE.encode(),
    "b.ipynb": json.dumps(
        {"nbformat": 4, "cells": [{"cell_type": "code", "metadata": {}, "source": "f(\ud800"}]}
    ).encode(),
    "c.ipynb": b"\xff\x00",
}
CALL = Call(id="1", question="q", function="double", arguments=(21,))


def test_what_a_box_finds_is_what_anybody_finds_and_it_goes_on_with_it(slot):
    found = slot.extract(FILES, FUNCTIONS)
    assert found == extract(FILES, FUNCTIONS)
    assert len(found.notes) == len(found.unread) == 1
    (outcome,) = slot.run(found.cells, [CALL])
    assert outcome.value == 42


def test_a_box_that_read_and_is_not_asked_is_ended_with_the_next(slot):
    for _ in range(2):
        assert slot.extract(FILES, FUNCTIONS).cells
    assert slot.run((), [CALL])[0].status is OutcomeStatus.NOT_DEFINED


LONG = {"a.ipynb": b'{"cells": [' + b'"", ' * 12_000_000 + b"1]}"}


@pytest.mark.parametrize(
    ("limits", "patience", "says"),
    [
        (Limits(), 0.001, "it took longer than 0.001 s"),
        (Limits(memory=64 << 20), 120.0, "could not be read: the program ended itself"),
    ],
    ids=["time", "memory"],
)
def test_files_that_take_too_much_are_named_and_the_next_are_read(
    open_slot, monkeypatch, limits, patience, says
):
    with open_slot(limits) as slot:
        with monkeypatch.context() as hasty:
            hasty.setattr(extraction, "PATIENCE", patience)
            found = slot.extract(LONG, FUNCTIONS)
        assert found.cells == ()
        assert says in found.unread[0]
        assert slot.extract(FILES, FUNCTIONS).cells


def frame_of(files):
    sent = {name: data.from_bytes(held) for name, held in files.items()}
    return data.unpack(data.pack(worker.found_in(sent, FUNCTIONS)))


VALUES = st.none() | st.integers() | st.text() | st.just(()) | st.just(np.zeros(2))


@given(st.sampled_from(sorted(frame_of(FILES))), VALUES | st.tuples(VALUES))
def test_a_forged_extraction_is_refused_or_read_as_data(name, value):
    frame = frame_of(FILES) | {name: value}
    try:
        found = extraction.read_extraction(frame, FUNCTIONS)
    except data.WireError:
        return
    assert all(isinstance(text, str) for text in (*found.notes, *found.unread))
    assert {cell.question for cell in found.cells} <= {None, "q"}
    assert all(isinstance(cell.label, str) for cell in found.cells)
    assert all(isinstance(one, int) for one in found.passages)
