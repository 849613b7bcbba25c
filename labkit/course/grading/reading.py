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
MAX_BRACKETS = 1_000_000  # in a notebook: each takes memory, and deep ones the parser's stack
DIRECTORY, ENTRY = b"PK\1\2", 600  # what each file has in an archive; it takes as long as bytes
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # unpacked piece by piece; others at once
SECONDS, MEMORY, PATIENCE = 10, 1024 * MEBIBYTE, 300.0  # of the process; by the clock
SKIPPED = {
    ".ipynb_checkpoints", "__MACOSX", "__pycache__", ".git", ".venv", "node_modules", "Thumbs.db",
    "desktop.ini",
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
    """Read the cells of all files, and choose those that are run.

    Of several files those run that define a function that is asked for, the one with the most
    answers last: of two answers to one question, its counts. Of two with as many, it is the newer
    one: `files` come in that order, and archives tell the times of what they hold.

    Examples
    --------
    >>> program = read_program({"a.py": b"def f(): pass", "b.py": b"k = 1"}, ["f"])
    >>> [cell.label for cell in program.cells], list(program.scripts)
    (['a.py'], ['a.py', 'b.py'])
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
                cells = list(notebook_cells(name if len(sources) > 1 else "", data))
                scripts[name] = "\n\n".join(cell.source for cell in cells)
            else:
                scripts[name] = decoded(data)
                cells = list(script_cells(name, scripts[name]))
            left -= len(scripts[name])
            if left < 0:
                raise ValueError("all files together hold too much code")
            for place, cell in enumerate(cells):
                if "\0" in cell.source:
                    line = cell.source.partition("\0")[0].count("\n") + 1
                    notes.append(
                        f"line {line} of {cell.label} holds a NUL byte, which was left out"
                    )
                    cells[place] = Cell(cell.source.replace("\0", ""), cell.label)
            scripts[name] = scripts[name].replace("\0", "")
            read[name] = cells
            found = (answer.findall(cell.source) for cell in cells)
            answers[name] = {one or other for each in found for one, other in each}
        except Exception as error:  # untrusted
            scripts.pop(name, None)
            unread.append(f"{name} cannot be read: {error or type(error).__name__}")
    code = "\n\n".join(cell.source.lstrip("\n") for cells in read.values() for cell in cells)
    chosen = sorted(filter(answers.get, sources), key=lambda one: len(answers[one]))
    for older in chosen[:-1]:
        if answers[older] <= answers[chosen[-1]]:
            notes.append(f"{older} and {chosen[-1]} answer the same; the latter counts")
    return Program(
        cells=[cell for name in chosen or list(read)[:1] for cell in read[name]],
        scripts=scripts,
        code=code.encode("utf-8", "replace").decode(),
        notes=notes,
        unread=unread[:40],
    )


def unpacked(files: Mapping[str, bytes]) -> tuple[dict[str, bytes], list[str]]:
    """The notebooks and scripts, those in archives too, from old to new, and what is unread.

    Whatever a file makes a reader raise is said of that file, and the others are read.
    """
    found: dict[str, bytes] = {}
    times: dict[str, tuple[int, ...]] = {name: (k,) for k, name in enumerate(files)}
    unread: list[str] = []
    left = MAX_TOGETHER
    for name in sorted(filter(may_hold_source, files), key=likely_first):
        data = files[name]
        try:
            inner = {name: data} if is_source(name) else unzip(name, data, left, times)
            left -= sum(map(len, inner.values()))
            if left < 0:
                raise ValueError("all files together are too large; clear the outputs")
            found |= {inside: held for inside, held in inner.items() if not is_handed_out(inside)}
        except Exception as error:  # untrusted: zipfile and its like raise anything
            unread.append(f"{name} cannot be read: {error}")
    if files and not found and not unread:
        names = ", ".join(files)
        unread.append(f"no notebook (.ipynb) or script (.py) of your own is in {names}")
    if len(found) > MAX_FILES:
        unread.append(f"of {len(found)} files {MAX_FILES} are read; hand in your own alone")
    kept = list(found)[:MAX_FILES]
    return {name: found[name] for name in sorted(kept, key=times.__getitem__)}, unread


def unzip(name: str, data: bytes, most: int, times: dict[str, tuple[int, ...]]) -> dict[str, bytes]:
    """The notebooks and scripts in an archive; archives in it are passed over.

    Raises
    ------
    ValueError
        Where it holds more than `most` bytes, counting some for each file however small.
        What is no zip archive raises what `zipfile` raises.
    """
    files: dict[str, bytes] = {}
    most -= ENTRY * data.count(DIRECTORY)
    if most < 0:
        raise ValueError("it holds too many files; hand in your own alone")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in sorted(archive.infolist(), key=lambda info: likely_first(info.filename)):
            inner = f"{name}/{printable(info.filename)}"
            if is_skipped(inner) or not is_source(inner):
                continue
            files[inner] = member(archive, info, min(most, MAX_FILE))
            times[inner] = info.date_time
            most -= len(files[inner])
            if most < 0 or len(files[inner]) > MAX_FILE:
                raise ValueError(f"{inner} and those before it are too large; clear the outputs")
    return files


def member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, most: int) -> bytes:
    """The bytes of a member, and one more than `most` where there are more."""
    if info.compress_type not in PACKINGS:
        raise zipfile.BadZipFile("unsupported compression; create a normal zip file")
    with archive.open(info) as packed:
        return packed.read(most + 1)


def notebook_cells(name: str, data: bytes) -> Iterator[Cell]:
    """The code cells of a notebook."""
    if data.count(b"[") + data.count(b"{") > MAX_BRACKETS:
        raise ValueError("it holds too many brackets for a notebook")
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
    above, parts = 0, MARK.split(text, maxsplit=MAX_CELLS)
    for part in parts:
        yield Cell("\n" * above + part, name)
        above += part.count("\n")


def decoded(data: bytes) -> str:
    """The text of a script, in the encoding that it names; UTF-8 without one."""
    encoding, _ = tokenize.detect_encoding(io.BytesIO(data).readline)
    return _unix(data.decode(encoding)).removeprefix("\ufeff")


def _unix(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def is_source(name: str) -> bool:
    """True if a file can hold answers."""
    return name.lower().endswith(SOURCES)


def may_hold_source(name: str) -> bool:
    """True if it is a file with answers, or an archive that may hold one."""
    return name.lower().endswith((*SOURCES, ".zip"))


def likely_first(name: str) -> tuple[bool, bool, int, str]:
    """A key by which notebooks come first, then scripts, and files of the top folder before."""
    return ".ipynb" not in name.lower(), not is_source(name), name.count("/"), name


def is_skipped(name: str) -> bool:
    """True if a file is none of the student's: what editors and systems leave behind."""
    path = PurePosixPath(name)
    return bool(SKIPPED & set(path.parts)) or path.name.startswith(".")


def is_handed_out(name: str) -> bool:
    """True if a file is part of a copy of labkit, by its place.

    >>> is_handed_out("lab/labkit/se2.py"), is_handed_out("se2.py")
    (True, False)
    """
    _, inside, place = name.rpartition("labkit/")
    return bool(inside) and (PACKAGE / place).is_file()


def printable(name: str) -> str:
    r"""A file's name as text that can be printed and stored: on disk it may be any bytes.

    Two names stay two: what cannot be printed is spelled out.

    >>> print(printable("ad\u202ea"), printable("ad\udcff"))
    ad\u202ea ad\xff
    """
    text = name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


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
