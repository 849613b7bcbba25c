"""Law 6: hostile files cost nobody else time or points."""

import io
import json
import zipfile

from labkit.grading import grade as grading
from labkit.grading import sitting
from labkit.grading.box.inside.reading import read_program
from labkit.grading.box.outside import Wall
from labkit.grading.box.watch import BoxError
from tests.grading.failing import ASSIGNMENT, NAMES
from tests.grading.liar import Liar
from tests.grading.notebooks import cell, notebook
from tests.grading.small import RIGHT as RIGHT_NUMBERS
from tests.grading.small import hand_in, scores


class Ending(Liar):
    """A box that every cell ends at once."""

    count = 0

    def __init__(self, wall, seconds):
        super().__init__(wall, seconds)
        Ending.count += 1

    def send(self, allowed, attached=b"", **order):
        if "sizes" in order:
            self.said = [read_program({"a.ipynb": attached}, NAMES)._asdict()]

    def receive(self, most=0):
        if not self.said:
            raise BoxError("the program ended")
        return self.said.pop()


def test_who_ends_every_box_gets_no_box_for_ever(monkeypatch):
    """Law 6: 900 cells that end the program once held a class for a quarter of an hour."""
    monkeypatch.setattr(sitting, "Box", Ending)
    files = {"a.ipynb": notebook([cell("import os\nos._exit(0)")] * 900)}

    verdict, _ = grading.grade_submission(files, Wall("none"), ASSIGNMENT, "ada")

    assert verdict.score == 0.0
    assert 50 < Ending.count < 150


def zipped(name, data):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return buffer.getvalue()


def zipped_all(files):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files:
            archive.writestr(name, data)
    return buffer.getvalue()


CELL = {"cell_type": "code", "source": "def double(x): return 2 * x"}
THREADS = (
    "import threading\nthreading.stack_size(32768)\n"
    "for _ in range(8000):\n    threading.Thread(target=threading.Event().wait).start()\n"
)
SPEAKING = (
    "import gc, os, threading\n"
    "own = next(one for one in gc.get_objects() if type(one).__name__ == 'Session')\n"
    "def say():\n    while True:\n        os.write(own.writing, {words})\n"
    "threading.Thread(target=say, daemon=True).start()\n"
)
HOSTILE = {  # each once held up its neighbours
    "flood.py": SPEAKING.format(words="b'{\"cell\": 0}\\n'") + RIGHT_NUMBERS,
    "drip.py": SPEAKING.format(words="b' '") + RIGHT_NUMBERS,
    "answers.py": SPEAKING.format(words="b'{\"answers\": {}}\\n'") + RIGHT_NUMBERS,
    "brackets.zip": zipped("a.ipynb", b'{"cells": [' + b"[[[[[1]]]]]," * (2 << 20) + b"1]}"),
    "deep.zip": zipped("a.ipynb", b"[" * (20 << 20)),
    "notebooks.zip": zipped_all(
        (f"{k}.ipynb", json.dumps({"cells": [CELL] * 999})) for k in range(300)
    ),
    "threads.py": THREADS + RIGHT_NUMBERS,
    "cells.zip": zipped("a.ipynb", json.dumps({"cells": [{"cell_type": "code"}] * 900_000})),
}


def test_beside_hostile_hand_ins_honest_ones_keep_their_marks(grade, tmp_path):
    """Law 6."""
    expected = hand_in(tmp_path / "class", 8)
    for name, content in HOSTILE.items():
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / "class" / name).write_bytes(data)
    assert grade("class") == 0
    found = scores()
    assert {student: found[student] for student in expected} == expected
    assert len(found) == 8 + len(HOSTILE)
