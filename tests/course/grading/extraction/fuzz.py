"""How long the slowest of many files takes to be read: run by hand, not by the tests.

``python tests/course/grading/extraction/fuzz.py [--files 20000] [--seed 0]`` makes files of
repeated pieces of Python (what a parser or a slicer may choke on), of Python that is cut and
mixed, and of the solved assignment with bytes changed. They are of all lengths up to the longest
that is read (as `cost_of` counts them), as many between 2 and 4 kB as between 128 and
256; those that are slowest for their length are read again at full length. Nothing but an
`Extraction` may come of any. The times are processor time; the last line is the worst one.
"""

from __future__ import annotations

import argparse
import json
import random
import time

from labkit.course.authoring.notebook import notebook_text
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.extraction.cells import MAX_CODE, cost_of
from labkit.course.grading.extraction.extract import extract

SMALL, LARGE = 2_000, MAX_CODE - 2_000  # characters
SLOWEST = 60
HEADS = (
    "", "def icp():\n ", "def icp(a):\n  return ", "class A:\n ", "x = ", "x = (", "x = [",
    "if a:\n ", "try:\n ", "while a: ", "%%time\n", "%%bash\n", "f'", "f'''", '"""', "rb'", "@",
    "lambda: ", "async def rotation():\n await ", "match a:\n case ", "with a as ", "import ",
    "from a import ", "global ", "def rotation(", "{", "x: ", "!ls\n", "# ", "\\\n",
    "for a in b:\n ", "del ",
)  # fmt: skip
PIECES = (
    "a", "a ", "a,", "a;", "a\n", "a\n ", "a=1;", "a=1\n ", "a=", "a.", "a()", "a[0]", "a+", "a<",
    "-", "(", ")", "[", "]", "{", "}", "{a}", "{a!r:{b}}", "'a' ", "f'{a}' ", "'", '"', "'''",
    '"""', "\\", "\\\n", "lambda:", "lambda:0,", "[0 for x in y],", "(yield),", "x:=1,", "1:2,",
    "**a,", "*a,", "if a else ", "and ", "not ", "await ", "def f():0\n ", "def f():\n",
    "class A:0\n ", "@a\n", "import a\n", "elif a:0\n", "except a:0\n", "case 1:0\n",
    "global a\n ", "nonlocal a\n ", "a?\n", "!a\n", "%a\n", "#\n", " ", "\t", "\n", "\r", "\f",
    "\0", "9", "0x", "1e", "é", "\u200b", "a.b=1\n ", "a.append(a)\n ", "del a\n ", "async ",
    "print(a)\n ", "...", "->", ":", "=", "==", "return a\n ",
)  # fmt: skip
NUMBERED = (
    "a{i},", "a{i}=b{i};", "a{i}=lambda:b{i}\n ", "def f{i}():f{i}()\n", "a{i}.b=c{i}\n ",
    "g{i}()\n", "import a{i}\n", "global a{i}\n ", "{{a{i}}}", "x[{i}]=a{i}\n",
)  # fmt: skip
TAILS = ("", ")", "]", "}", "'", '"""', "\n return a\n", ": 0\n", "\ndef rotation(a): return a\n")


def repeated(rng: random.Random, size: int) -> str:
    """A head, one to three pieces over and over, a tail."""
    pieces = [rng.choice(PIECES + NUMBERED) for _ in range(rng.choice((1, 1, 2, 3)))]
    text, number = [rng.choice(HEADS)], 0
    left = size
    while left > 0:
        for piece in pieces:
            part = piece.format(i=number) if piece in NUMBERED else piece
            text.append(part)
            left -= len(part)
        number += 1
    return "".join((*text, rng.choice(TAILS)))


def mixed(rng: random.Random, size: int) -> str:
    """Any heads and pieces in any order."""
    text = []
    left = size
    while left > 0:
        text.append(rng.choice(HEADS + PIECES + TAILS))
        left -= len(text[-1]) or 1
    return "".join(text)


def damaged(rng: random.Random, size: int, cells: list[str]) -> str:
    """The solved assignment as a script, parts of it repeated, cut out and overwritten."""
    text = "\n".join(rng.choice(cells) for _ in range(len(cells)))
    while len(text) < size:
        text += "\n" + rng.choice(cells)
    for _ in range(rng.randrange(8)):
        start, length = rng.randrange(len(text)), rng.randrange(80)
        put = rng.choice(("", rng.choice(PIECES), text[:length], "".join(rng.choices(PIECES, k=5))))
        text = text[:start] + put + text[start + length :]
    return text


def as_file(rng: random.Random, text: str) -> dict[str, bytes]:
    """A script, or a notebook of one cell or of many."""
    data = text.encode("utf-8", "replace")
    if rng.random() < 0.7:
        return {"a.py": data}
    cells = [text] if rng.random() < 0.5 else text.split("\n\n")
    code = [{"cell_type": "code", "source": cell, "metadata": {}} for cell in cells[:4000]]
    return {"a.ipynb": json.dumps({"nbformat": 4, "cells": code}).encode()}


def main() -> None:
    """Generate, time, tell."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--files", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    functions = {one.id: one.function for one in load_assignment(hidden=False).questions}
    notebook = json.loads(notebook_text(solutions=True))
    cells = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]

    def text_of(rng: random.Random, size: int) -> str:
        kind = rng.choice("rrrmd")
        if kind == "r":
            return repeated(rng, size)
        return mixed(rng, size) if kind == "m" else damaged(rng, size, cells)

    def made(number: int, size: int) -> dict[str, bytes]:
        cost = cost_of([text_of(random.Random(f"{args.seed} {number}"), size)])
        rng = random.Random(f"{args.seed} {number}")
        share = min(1.0, size / cost)  # or it would be refused for its length
        return as_file(rng, text_of(rng, round(share * size)))

    def timed(number: int, size: int) -> float:
        files = made(number, size)
        start = time.process_time()
        try:
            extract(files, functions)
        except BaseException:
            print(f"file {number} of {size} characters:", flush=True)
            raise
        return time.process_time() - start

    sizes = [round(SMALL * (LARGE / SMALL) ** (n / args.files)) for n in range(args.files)]
    random.Random(args.seed).shuffle(sizes)
    times = [(timed(n, size), n, size) for n, size in enumerate(sizes)]
    slow = sorted(times, reverse=True)
    mean = sum(seconds for seconds, *_ in times) / len(times)
    print(f"{args.files} files of {SMALL} to {LARGE} characters: "
          f"slowest {slow[0][0]:.2f} s, mean {mean:.3f} s")  # fmt: skip
    for_size = sorted(times, key=lambda one: -one[0] / one[2])[:SLOWEST]
    slow += [(timed(n, LARGE), n, LARGE) for _, n, _ in for_size]
    slow.sort(reverse=True)
    for seconds, number, size in slow[:5]:
        (shown,) = made(number, 60).values()
        print(f"  {seconds:.2f} s  file {number}, {size} characters: {shown[:70]!r}")
    print(f"with the {SLOWEST} slowest for their size at full size: worst {slow[0][0]:.2f} s")


if __name__ == "__main__":
    main()
