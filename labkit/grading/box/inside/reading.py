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
from collections.abc import Collection, Iterable, Iterator, Mapping
from importlib.util import decode_source
from itertools import chain
from pathlib import PurePosixPath
from typing import Any, NamedTuple

from labkit.grading.box.inside.limits import (
    MAX_CELLS,
    MAX_DEPTH,
    MAX_FILE,
    MAX_SOURCE,
    MAX_WRITTEN,
)

WRITTEN = re.compile(r"\A\s*%%writefile\s+(?:-a\s+)?(\S+\.py)[ \t]*\n")  # by a cell
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
    written: str = ""  # answers in Markdown, for a person


def read_program(
    files: Mapping[str, bytes], functions: Collection[str], handed_out: Collection[str] = ()
) -> Program:
    """Read the cells of all files, and choose those that are run; `handed_out` are labkit's own.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts. Of two with as many, it is the newer
    one. A file that cannot be read costs itself alone; of too much code the newest is read.
    """
    read: dict[str, list[tuple[str, str]]] = {}  # cells with their names in it, by file name
    texts: dict[str, str] = {}
    unread: list[str] = []
    letters_left = MAX_SOURCE
    cells_left = MAX_CELLS
    sources = filter(may_hold_source, reversed([*files]))
    for name, data in chain.from_iterable(unpack(name, files[name], unread) for name in sources):
        _, is_inside, place = name.rpartition("labkit/")
        if is_inside and place in handed_out:
            continue
        try:
            if len(data) > MAX_FILE:
                raise ValueError(TOO_LARGE)
            if name.lower().endswith(NOTEBOOK):
                contents, texts[name] = read_notebook(data)
            else:
                contents = [(text_of(data), "")]
            letters_left -= sum(len(source) for source, _ in contents)
            cells_left -= len(contents)
            if letters_left < 0 or cells_left < 0:
                raise ValueError("all files together hold too much code")
            read[name] = contents
        except Exception as error:  # untrusted
            unread.append(f"{name} cannot be read: {why_unread(error)}")
    if not read and not unread:
        names = ", ".join(list(files)[:5]) or "nothing"
        unread.append(f"no notebook (.ipynb) or script (.py) was handed in, only {names}")
    names = "|".join(functions)
    answer = re.compile(rf"^[ \t]*(?:def[ \t]+({names})\b|({names})[ \t]*=)", re.MULTILINE)
    read = dict(reversed(read.items()))
    scripts = {
        name: "\n\n".join(source for source, _ in contents).replace("\0", "")
        for name, contents in read.items()
    }
    scripts |= find_written_scripts(source for contents in read.values() for source, _ in contents)
    answers = {name: set(map("".join, answer.findall(scripts[name]))) for name in read}
    chosen = sorted(filter(answers.get, read), key=lambda name: len(answers[name]))
    cells: list[tuple[str, str]] = []
    notes: list[str] = []
    for name in chosen or list(read)[:1]:
        if name in chosen[:-1] and answers[name] <= answers[chosen[-1]]:
            notes.append(f"{name} and {chosen[-1]} answer the same; those of {chosen[-1]} count")
        for source, place in read[name]:
            label = f"{place} of {name}" if place and len(read) > 1 else place or name
            above, nul, _ = source.partition("\0")
            if nul:
                line = above.count("\n") + 1
                notes.append(f"line {line} of {label} holds a NUL byte, which was left out")
            cells.append((source.replace("\0", ""), label))
    written = "\n\n".join(texts[name] for name in chosen if texts.get(name))
    return Program(cells, scripts, notes, unread[:40], written[:MAX_WRITTEN])


def why_unread(error: Exception) -> str:
    """The reason why a file cannot be read, for the student."""
    if isinstance(error, UnicodeDecodeError):
        return "it is no text, and so no notebook"
    if isinstance(error, json.JSONDecodeError):
        return f"it is no notebook from line {error.lineno} on"
    if isinstance(error, MemoryError | RecursionError):
        return TOO_LARGE
    return str(error) or type(error).__name__


def find_written_scripts(sources: Iterable[str]) -> dict[str, str]:
    """Find the scripts that cells write by ``%%writefile``."""
    heads = [(WRITTEN.match(source), source) for source in sources]
    return {
        head[1].removeprefix("./"): source[head.end() :].replace("\0", "")
        for head, source in heads
        if head
    }


def unpack(
    name: str, data: bytes, unread: list[str], depth: int = MAX_DEPTH
) -> Iterator[tuple[str, bytes]]:
    """A notebook or script, or those in an archive from new to old.

    An archive that cannot be read is added to `unread`.
    """
    if is_source(name):
        yield name, data
        return

    def age(info: zipfile.ZipInfo) -> tuple[object, int]:
        return info.date_time, -len(info.filename)

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for info in sorted(archive.infolist(), key=age, reverse=True):
                inner = f"{name}/{printable(info.filename)}"
                is_wanted = is_source(inner) or (depth > 1 and may_hold_source(inner))
                if is_wanted and not is_skipped(info.filename):
                    with archive.open(info) as packed:
                        content = packed.read(MAX_FILE + 1)
                    yield from unpack(inner, content, unread, depth - 1)
    except Exception as error:  # untrusted: zipfile raises anything
        unread.append(f"{name} cannot be read: {error}")


def text_of(data: bytes) -> str:
    """The text of a script: in the encoding that it declares, or as PowerShell writes it.

    Where it is in another one and does not say so (cp1252, GBK), each byte becomes a letter: code
    is in ASCII, and what comments say is not run.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return decode_source(data)
    except (UnicodeDecodeError, SyntaxError):
        return data.decode("latin-1").replace("\r\n", "\n")


def read_notebook(data: bytes) -> tuple[list[tuple[str, str]], str]:
    """The code of a notebook, cells with their numbers, and the Markdown of a student.

    Of nbgrader's cells those for answers are the student's, of others all.
    """
    if not data.strip():
        raise ValueError("it is empty")
    content: Any = json.loads(data.decode(json.detect_encoding(data), "surrogatepass"))
    if not isinstance(content, dict) or not isinstance(content.get("cells"), list):
        raise ValueError("it is no notebook of nbformat 4")
    cells = [cell for cell in content["cells"] if isinstance(cell, dict)]
    codes = [cell for cell in cells if cell.get("cell_type") == "code"]
    texts = [cell for cell in cells if cell.get("cell_type") == "markdown"]
    marked = [cell for cell in texts if "nbgrader" in str(cell.get("metadata"))]
    answers = [cell for cell in marked if cell["metadata"]["nbgrader"].get("solution")]
    written = "\n\n".join(map(source_of, answers if marked else texts))
    return [(source_of(cell), f"cell {number}") for number, cell in enumerate(codes, 1)], written


def source_of(cell: dict[str, Any]) -> str:
    """The source of a cell, as one text that can be printed and parsed."""
    return replace_surrogates("".join(cell.get("source") or "").replace("\r\n", "\n"))


def replace_surrogates(source: str) -> str:
    """Replace lone surrogates, which no parser takes, in source."""
    return source.encode("utf-8", "replace").decode()


def is_source(name: str) -> bool:
    """True if a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """True if it is a file with answers, or an archive that may hold one."""
    return name.lower().endswith((*SOURCES, ".zip"))


def is_skipped(name: str) -> bool:
    """True if a file is none of the student's: what editors, systems and platforms add."""
    parts = [part for part in PurePosixPath(name).parts if part != ".."]
    return any(part in SKIPPED or part.startswith(".") for part in parts)


def printable(name: str) -> str:
    r"""A file's name as text that can be printed and stored: on disk it may be any bytes.

    >>> print(printable("ad\u202ea"), printable("ad\udcff"))
    ad\u202ea ad\udcff
    """
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in name)
