"""The law of claims: what a chapter says of data in general holds on other samples, too.

A claim runs the chapter's own cells again, with other seeds, pairs or stretches of the drive put
into them. CI's nightly (`LABKIT_EXAMPLES=nightly`) tries every sample, each other run one of them,
which changes with the commit.
"""

from __future__ import annotations

import os
import re
import subprocess
import symtable
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import nbformat
import pytest

ROOT = Path(__file__).parents[2]
CHANGING = "append|extend|setdefault|update"  # methods that change an object in place
Edits = dict[str, str]  # of the chapter's source, an old text and a new one


def claim(says: str, samples: list[Edits]) -> Callable[[Callable], Callable]:
    """Make a test of a claim: the sentence, and the edits that give each other sample."""
    chosen = samples if os.environ.get("LABKIT_EXAMPLES") == "nightly" else [of_today(samples)]
    return pytest.mark.parametrize("sample", chosen, ids=lambda edits: ", ".join(edits.values()))


def of_today(samples: list[Edits]) -> Edits:
    """One of the samples; which one changes with the commit."""
    asked = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    commit = subprocess.run(asked, capture_output=True, check=False).stdout
    return samples[zlib.crc32(commit) % len(samples)]


def cells_after(chapter: str, sample: Edits, *asked: str) -> dict[str, object]:
    """The names that the asked cells of a chapter set, all run with the edits of a sample.

    The cells before them are run as far as the asked ones need what they set. Each edit has to
    apply; where a stub stands, the solution runs.
    """
    cells, unused = code_of(chapter), set(sample)
    for name, source in cells.items():
        for old, new in sample.items():
            if old in source:
                unused.discard(old)
                cells[name] = cells[name].replace(old, new)
    assert not unused, f"no cell of chapter {chapter} holds {unused}"
    names: dict[str, object] = {}
    for name in needed(cells, asked):
        exec(compile(cells[name], f"chapter {chapter}, cell {name}", "exec"), names)
    plt.close("all")
    return names


@cache
def _notebook(chapter: str) -> nbformat.NotebookNode:
    (path,) = (ROOT / "notebooks").glob(f"{chapter}_*.ipynb")
    return nbformat.read(path, as_version=4)


def code_of(chapter: str) -> dict[str, str]:
    """The code of a chapter by the names of its cells, without magics, stubs and asserts."""
    cells = {}
    for cell in _notebook(chapter).cells:
        tags = set(cell.metadata.get("tags", []))
        if cell.cell_type == "code" and not tags & {"stub", "remove-cell"}:
            cells[cell.id] = re.sub(r"(?m)^%.*$", "", cell.source)
    return cells


def needed(cells: Edits, asked: tuple[str, ...]) -> list[str]:
    """The asked cells, and before them those that set or change what they read, in order."""
    wanted: set[str] = set()
    kept = []
    for name in reversed(cells):
        reads, sets, changes = flow(cells[name])
        if name in asked or (sets | changes) & wanted:
            kept.append(name)
            wanted = wanted - sets | reads | changes
    assert set(asked) <= set(kept), set(asked) - set(kept)
    return kept[::-1]


def flow(source: str) -> tuple[set[str], set[str], set[str]]:
    """The names that a cell reads, those that it sets, and those that it changes in place."""
    tables = [symtable.symtable(source, "cell", "exec")]
    symbols = tables[0].get_symbols()
    sets = {each.get_name() for each in symbols if each.is_assigned() or each.is_imported()}
    for table in tables:
        tables += table.get_children()
    used = [each for table in tables for each in table.get_symbols() if each.is_referenced()]
    reads = {each.get_name() for each in used if each.is_global()} - sets
    changes = set(re.findall(rf"(?m)^ *(\w+)(?:\[.*?\] \|?= |\.(?:{CHANGING})\()", source))
    return reads, sets, changes
