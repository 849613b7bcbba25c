"""From the files of a submission to the cells that are run: notebooks, scripts, archives of them.

It runs in the box, before any code of the submission, so a file that holds up a parser costs
its own student alone.
"""

from __future__ import annotations

import codecs
import io
import json
import re
import zipfile
from collections.abc import Collection, Iterator, Mapping
from importlib.util import decode_source
from pathlib import PurePosixPath
from typing import Any, NamedTuple

MAX_FILE = 32 << 20  # bytes of a notebook with its pictures
MAX_SOURCE = 2 << 20  # letters of code in all files
MAX_CELLS = 1000
MAX_BRACKETS = 300_000  # in a notebook: each takes memory and time, and deep ones the stack
TOO_LARGE = "the files are too large; clear the outputs, and hand in your own alone"
SKIPPED = {
    "__MACOSX", "__pycache__", "node_modules", "Thumbs.db", "desktop.ini",
    "submission_metadata.yml", "timestamp.txt",
}  # fmt: skip
NOTEBOOK = (".ipynb", ".ipynb.txt", ".ipynb.json")  # browsers add an ending
SOURCES = (*NOTEBOOK, ".py", ".py.txt")


class Program(NamedTuple):
    """Cells and scripts of a submission."""

    cells: list[tuple[str, str]]  # to run, each with its name in messages: "cell 7", "a.py"
    scripts: dict[str, str]  # all that was read, by file name: a cell may import it
    notes: list[str]  # on how it was read
    unread: list[str]  # what was not read, and why


def read_program(
    files: Mapping[str, bytes], functions: Collection[str], handed_out: Collection[str] = ()
) -> Program:
    """Read the cells of all files, and choose those that are run; `handed_out` are labkit's own.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts. Of two with as many, it is the newer
    one. A file that cannot be read costs itself alone; of too much code the newest is read.
    """
    read: dict[str, list[tuple[str, str]]] = {}  # cells with their names in it, by file name
    unread: list[str] = []
    left = MAX_SOURCE
    for name, data in unpacked(files, unread):
        _, is_inside, place = name.rpartition("labkit/")
        if is_inside and place in handed_out:
            continue
        try:
            if len(data) > MAX_FILE:
                raise ValueError(TOO_LARGE)
            is_notebook = name.lower().endswith(NOTEBOOK)
            found = notebook_cells(data) if is_notebook else [(text_of(data), "")]
            left -= sum(len(source) for source, _ in found)
            if left < 0:
                raise ValueError("all files together hold too much code")
            read[name] = found
        except json.JSONDecodeError as error:
            unread.append(f"{name} cannot be read: it holds no notebook ({error})")
        except (UnicodeDecodeError, SyntaxError):
            unread.append(f"{name} cannot be read: it is not in UTF-8; save it as UTF-8")
        except Exception as error:  # untrusted
            unread.append(f"{name} cannot be read: {error or type(error).__name__}")
    if not read and not unread:
        names = ", ".join(list(files)[:5]) or "nothing"
        unread.append(f"no notebook (.ipynb) or script (.py) was handed in, only {names}")
    names = "|".join(functions)
    answer = re.compile(rf"^[ \t]*(?:def[ \t]+({names})\b|({names})[ \t]*=)", re.MULTILINE)
    read = dict(reversed(read.items()))
    scripts = {
        name: "\n\n".join(source for source, _ in found).replace("\0", "")
        for name, found in read.items()
    }
    answers = {name: set(map("".join, answer.findall(text))) for name, text in scripts.items()}
    chosen = sorted(filter(answers.get, read), key=lambda name: len(answers[name]))
    cells: list[tuple[str, str]] = []
    notes: list[str] = []
    for name in chosen or list(read)[:1]:
        if name in chosen[:-1] and answers[name] <= answers[chosen[-1]]:
            notes.append(f"{name} and {chosen[-1]} answer the same; the better answers count")
        for source, place in read[name]:
            label = f"{place} of {name}" if place and len(read) > 1 else place or name
            above, nul, _ = source.partition("\0")
            if nul:
                line = above.count("\n") + 1
                notes.append(f"line {line} of {label} holds a NUL byte, which was left out")
            cells.append((source.replace("\0", ""), label))
    return Program(cells, scripts, notes, unread[:40])


def unpacked(files: Mapping[str, bytes], unread: list[str]) -> Iterator[tuple[str, bytes]]:
    """The notebooks and scripts from new to old, those in archives too; none in an inner archive.

    An archive that cannot be read is added to `unread`.
    """

    def age(info: zipfile.ZipInfo) -> tuple[object, int]:
        return info.date_time, -len(info.filename)

    for name in filter(may_hold_source, reversed([*files])):
        if is_source(name):
            yield name, files[name]
            continue
        try:
            with zipfile.ZipFile(io.BytesIO(files[name])) as archive:
                for info in sorted(archive.infolist(), key=age, reverse=True):
                    inner = f"{name}/{printable(info.filename)}"
                    if is_source(inner) and not is_skipped(info.filename):
                        with archive.open(info) as packed:
                            yield inner, packed.read(MAX_FILE + 1)
        except Exception as error:  # untrusted: zipfile raises anything
            unread.append(f"{name} cannot be read: {error}")


def text_of(data: bytes) -> str:
    """The text of a script: in the encoding that it declares, or as PowerShell writes it."""
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return data.decode("utf-16") if wide else decode_source(data)


def notebook_cells(data: bytes) -> list[tuple[str, str]]:
    """The code cells of a notebook, with their numbers."""
    if data.count(b"[") + data.count(b"{") > MAX_BRACKETS:
        raise ValueError("it holds too many brackets for a notebook; clear the outputs")
    content: Any = json.loads(data)  # in UTF-8, 16 or 32
    if not isinstance(content, dict) or not isinstance(content.get("cells"), list):
        raise ValueError("it is no notebook of nbformat 4")
    cells = [cell for cell in content["cells"] if isinstance(cell, dict)]
    codes = [cell for cell in cells if cell.get("cell_type") == "code"]
    if len(codes) > MAX_CELLS:
        raise ValueError(f"it has more than {MAX_CELLS} cells of code")
    sources = ("".join(cell.get("source") or "").replace("\r\n", "\n") for cell in codes)
    return [(source, f"cell {number}") for number, source in enumerate(sources, start=1)]


def is_source(name: str) -> bool:
    """True if a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """True if it is a file with answers, or an archive that may hold one."""
    return name.lower().endswith((*SOURCES, ".zip"))


def is_skipped(name: str) -> bool:
    """True if a file is none of the student's: what editors, systems and platforms add."""
    return any(part in SKIPPED or part.startswith(".") for part in PurePosixPath(name).parts)


def printable(name: str) -> str:
    r"""A file's name as text that can be printed and stored: on disk it may be any bytes.

    >>> print(printable("ad\u202ea"), printable("ad\udcff"))
    ad\u202ea ad\udcff
    """
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in name)
