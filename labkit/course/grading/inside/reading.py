"""From the files of a submission to the cells that are run: notebooks, scripts, archives of them.

What strangers wrote is parsed in a process of its own, this file alone, with limits of time and
memory: whatever a file makes of a parser, it holds up nobody else. A script is cut where its cells
begin (``# %%``, ``# In[3]:``); without these marks it is one cell.
"""

from __future__ import annotations

import importlib
import io
import json
import re
import subprocess
import sys
import tokenize
import zipfile
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

MEBIBYTE = 1 << 20
MAX_FILE = 32 * MEBIBYTE  # a notebook with its pictures
MAX_TOGETHER = 48 * MEBIBYTE  # of all files of one student
MAX_FILES = 200  # notebooks and scripts of one student
MAX_SOURCE = 2 * MEBIBYTE  # of code in them
MAX_CELLS = 1000
MAX_BRACKETS = 300_000  # in a notebook: each takes memory and time, and deep ones the stack
TOO_LARGE = "the files are too large or too many; clear the outputs, and hand in your own alone"
SECONDS, MEMORY, PATIENCE = 10, 1024 * MEBIBYTE, 300.0  # of the process; by the clock
SKIPPED = {
    "__MACOSX", "__pycache__", "node_modules", "Thumbs.db", "desktop.ini",
    "submission_metadata.yml", "timestamp.txt",
}  # fmt: skip
NOTEBOOK = (".ipynb", ".ipynb.txt", ".ipynb.json")  # browsers add an ending
SOURCES = (*NOTEBOOK, ".py", ".py.txt")
PACKAGE = Path(__file__).parents[2]
MARK = re.compile(r"^(?=# (?:%%|In\[[ \d]*\]:))", re.MULTILINE)


class Cell(NamedTuple):
    """A piece of a submission: its source, and what a message calls it ("cell 7", "a.py")."""

    source: str
    label: str


class Program(NamedTuple):
    """Cells and scripts of a submission."""

    cells: list[Cell]  # to run, from top to bottom
    scripts: dict[str, str]  # that they may import or run, by file name
    code: str  # all of it, run or not
    notes: list[str]  # on how it was read
    unread: list[str]  # what was not read, and why


def read_apart(files: Mapping[str, bytes], functions: Collection[str]) -> Program | None:
    """`read_program` in a process of its own; None where that got no processor in `PATIENCE`."""
    sizes = {name: len(data) for name, data in files.items()}
    head = json.dumps([sizes, list(functions)]).encode() + b"\n"
    command = [sys.executable, "-I", "-S", "-B", "-X", "utf8", __file__]
    try:
        done = subprocess.run(
            command, input=b"".join([head, *files.values()]), stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, check=False, timeout=PATIENCE,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        why = "the files cannot be read with little time and memory; hand in the notebook alone"
        return Program([], {}, "", [], [why])
    cells, *others = json.loads(done.stdout)
    return Program([Cell(*cell) for cell in cells], *others)


def read_program(files: Mapping[str, bytes], functions: Collection[str]) -> Program:
    """Read the cells of all files, from old to new, and choose those that are run.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts. Of two with as many, it is the newer
    one. A file that cannot be read costs itself alone.
    """
    sources, unread = unpacked(files)
    names = "|".join(functions)
    answer = re.compile(rf"^[ \t]*(?:def[ \t]+({names})\b|({names})[ \t]*=)", re.MULTILINE)
    read: dict[str, list[Cell]] = {}
    answers: dict[str, set[str]] = {}
    scripts: dict[str, str] = {}
    notes: list[str] = []
    left = MAX_SOURCE
    for name, data in sources.items():
        try:
            if name.lower().endswith(NOTEBOOK):
                cells = list(notebook_cells("" if len(sources) == 1 else name, data))
                text = "\n\n".join(cell.source for cell in cells)
            else:
                text = decoded(data)
                cells = list(script_cells(name, text))
            left -= len(text)
            if left < 0:
                raise ValueError("all files together hold too much code")
        except Exception as error:  # untrusted
            unread.append(f"{name} cannot be read: {error or type(error).__name__}")
            continue
        for source, label in cells:
            above, nul, _ = source.partition("\0")
            if nul:
                line = above.count("\n") + 1
                notes.append(f"line {line} of {label} holds a NUL byte, which was left out")
        read[name] = [Cell(source.replace("\0", ""), label) for source, label in cells]
        scripts[name] = text.replace("\0", "")
        answers[name] = {one or other for one, other in answer.findall(scripts[name])}
    chosen = sorted(filter(answers.get, read), key=lambda one: len(answers[one]))
    for older in chosen[:-1]:
        if answers[older] <= answers[chosen[-1]]:
            notes.append(f"{older} and {chosen[-1]} answer the same; the latter counts")
    return Program(
        cells=[cell for name in chosen or list(read)[:1] for cell in read[name]],
        scripts=scripts,
        code="\n\n".join(scripts.values()).encode("utf-8", "replace").decode(),
        notes=notes,
        unread=unread[:40],
    )


def unpacked(files: Mapping[str, bytes]) -> tuple[dict[str, bytes], list[str]]:
    """The notebooks and scripts, those in archives too, and what is unread; the order is kept."""
    found: dict[str, bytes] = {}
    unread: list[str] = []
    left = MAX_TOGETHER
    for name in filter(may_hold_source, reversed([*files])):  # of too many the newest are read
        try:
            held = [(name, files[name])] if is_source(name) else unzipped(name, files[name])
            for inner, data in held:
                if len(data) > min(left, MAX_FILE) or len(found) == MAX_FILES:
                    raise ValueError(TOO_LARGE)
                left -= len(data)
                if not is_handed_out(inner):
                    found[inner] = data
        except Exception as error:  # untrusted: zipfile raises anything
            unread.append(f"{name} cannot be read: {error}")
    if not found and not unread:
        names = ", ".join(list(files)[:5]) or "nothing"
        unread.append(f"no notebook (.ipynb) or script (.py) was handed in, only {names}")
    return dict(reversed(found.items())), unread


def unzipped(name: str, data: bytes) -> Iterator[tuple[str, bytes]]:
    """The notebooks and scripts in an archive, from new to old; archives in it are passed over."""

    def age(info: zipfile.ZipInfo) -> tuple[object, int]:
        return info.date_time, -len(info.filename)

    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in sorted(archive.infolist(), key=age, reverse=True):
            inner = f"{name}/{printable(info.filename)}"
            if is_source(inner) and not is_skipped(info.filename):
                with archive.open(info) as packed:
                    yield inner, packed.read(MAX_FILE + 1)


def notebook_cells(name: str, data: bytes) -> Iterator[Cell]:
    """The code cells of a notebook."""
    if data.count(b"[") + data.count(b"{") > MAX_BRACKETS:
        raise ValueError("it holds too many brackets for a notebook; clear the outputs")
    content: Any = json.loads(data)  # in UTF-8, 16 or 32
    if not isinstance(content, dict) or not isinstance(content.get("cells"), list):
        raise ValueError("it is no notebook of nbformat 4")
    codes = [cell for cell in content["cells"] if cell.get("cell_type") == "code"]
    if len(codes) > MAX_CELLS:
        raise ValueError(f"it has more than {MAX_CELLS} cells of code")
    for number, cell in enumerate(codes, start=1):
        text = "".join(cell.get("source", ""))
        yield Cell(_unix(text), f"cell {number} of {name}" if name else f"cell {number}")


def script_cells(name: str, text: str) -> Iterator[Cell]:
    """The cells of a script, each with as many empty lines before it as its line number says."""
    above = 0
    for part in MARK.split(text, maxsplit=MAX_CELLS):
        yield Cell("\n" * above + part, name)
        above += part.count("\n")


def decoded(data: bytes) -> str:
    """The text of a script, in the encoding that it names; UTF-8 without one."""
    encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
    return _unix(data.decode(encoding))


def _unix(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_source(name: str) -> bool:
    """True if a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """True if it is a file with answers, or an archive that may hold one."""
    return name.lower().endswith((*SOURCES, ".zip"))


def is_skipped(name: str) -> bool:
    """True if a file is none of the student's: what editors, systems and platforms add."""
    return any(part in SKIPPED or part.startswith(".") for part in PurePosixPath(name).parts)


def is_handed_out(name: str) -> bool:
    """True if a file is part of a copy of labkit, by its place: "lab/labkit/se2.py"."""
    _, inside, place = name.rpartition("labkit/")
    return bool(inside) and (PACKAGE / place).is_file()


def printable(name: str) -> str:
    r"""A file's name as text that can be printed and stored: on disk it may be any bytes.

    >>> print(printable("ad\u202ea"), printable("ad\udcff"))
    ad\u202ea ad\udcff
    """
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in name)


def main() -> None:
    """Read what comes on standard input; write a `Program` as JSON."""
    if sys.platform != "win32":
        resource = importlib.import_module("resource")
        limits = {"CPU": SECONDS, "FSIZE": 0, "CORE": 0}
        for kind, most in (limits | {"AS": MEMORY} if sys.platform == "linux" else limits).items():
            resource.setrlimit(getattr(resource, f"RLIMIT_{kind}"), (most, most))
    sizes, functions = json.loads(sys.stdin.buffer.readline())
    files = {name: sys.stdin.buffer.read(size) for name, size in sizes.items()}
    sys.stdout.write(json.dumps(read_program(files, functions)))  # in ASCII


if __name__ == "__main__":
    main()
