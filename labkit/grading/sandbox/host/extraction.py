"""The answers in a submission's files, found in the box that they will run in.

Parsing what somebody wrote is work for a box as well: it may take long, or bring the parser down.
No code of the submission's has run in it by then, yet what it sends is checked word by word.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from labkit.grading.contract import Extraction, SourceCell
from labkit.grading.sandbox.host.box import Box
from labkit.grading.sandbox.host.channel import GoneError, LateError, receive
from labkit.grading.sandbox.host.session import readable
from labkit.grading.sandbox.inside import data

MOST = 1 << 25  # bytes of code and remarks
PATIENCE = 60.0  # s; what is read takes one at most, where the machine has nothing else to do


def extract_in(
    box: Box, files: Mapping[str, bytes], functions: Mapping[str, str]
) -> tuple[Extraction, bool]:
    """What is graded of a submission, and whether the box can go on with it."""
    deadline = time.monotonic() + PATIENCE
    sent = {name: data.from_bytes(held) for name, held in files.items()}
    request = {"files": sent, "functions": dict(functions)}
    leaving = False
    try:
        box.channel.write(data.pack(request, data.MAX_REQUEST), deadline)
        frame, _ = receive(box.channel, MOST, deadline)
        return read_extraction(frame, functions), True
    except LateError:
        why = f"it took longer than {PATIENCE:g} s"
    except GoneError:
        leaving, why = True, ""
    except data.WireError:
        why = "what was found is more than one submission holds"
    end = box.stop(leaving)
    remark = f"the files could not be read: {why or end}; hand in the notebook alone"
    return Extraction(unread=(remark,)), False


def read_extraction(frame: Any, functions: Mapping[str, str]) -> Extraction:
    """The extraction that a frame describes.

    Raises
    ------
    labkit.grading.sandbox.inside.data.WireError
        If it describes none.
    """
    lists = ("sources", "questions", "labels", "notes", "unread")
    if not isinstance(frame, dict) or not all(type(frame.get(name)) is tuple for name in lists):
        raise data.WireError("no extraction")
    sources, questions, labels, notes, unread = (frame[name] for name in lists)
    if not len(sources) == len(questions) == len(labels):
        raise data.WireError("cells without a source, a question or a label")
    marks = frame.get("passages")
    if not isinstance(marks, np.ndarray) or marks.dtype != np.int64 or marks.ndim != 1:
        raise data.WireError("no passages")
    return Extraction(
        cells=tuple(map(_cell, sources, questions, labels, [functions] * len(sources))),
        notes=tuple(map(readable, notes)),
        unread=tuple(map(readable, unread)),
        passages=tuple(marks.tolist()),
    )


def _cell(source: Any, question: Any, label: Any, functions: Mapping[str, str]) -> SourceCell:
    known = question is None or (isinstance(question, str) and question in functions)
    if not isinstance(source, np.ndarray) or not known:
        raise data.WireError("a cell of no question that was asked")
    text = data.to_bytes(source).decode("utf-8", "replace")
    return SourceCell(source=text, question=question, label=readable(label))
