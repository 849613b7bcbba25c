"""The law of claims: what a chapter says of data in general holds on other samples, too.

A claim runs the chapter's own cells again, with other seeds, pairs or stretches of the drive put
into them. CI's nightly (`LABKIT_EXAMPLES=nightly`) tries every sample, each other run one of them,
which changes with the commit.
"""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import symtable
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import nbformat
import pytest
from matplotlib import pyplot as plt

import labkit
from labkit import odometry
from labkit.logs import Log, read_log
from labkit.odometry import OdometryResult, estimate_odometry

ROOT = Path(__file__).parents[2]
CHANGING = "append|extend|setdefault|update"  # methods that change an object in place


def on_other_samples(samples: list[dict[str, str]]) -> Callable[[Callable], Callable]:
    """Try a claim on samples: for each, edits of the chapter's source, by the old text."""
    chosen = dict(enumerate(samples))
    if os.environ.get("LABKIT_EXAMPLES") != "nightly":
        number = zlib.crc32(commit()) % len(samples)
        chosen = {number: samples[number]}
    return pytest.mark.parametrize("sample", chosen.values(), ids=map(str, chosen))


def commit() -> bytes:
    """The name of the commit that is tried; nothing where there is no repository."""
    command = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    return subprocess.run(command, capture_output=True, check=False).stdout


def run_cells(chapter: str, sample: dict[str, str], *cells: str) -> dict[str, object]:
    """Run cells of a chapter with the edits of a sample, and return all variables by name.

    Before them run the cells that set what they need. Each edit has to apply.
    """
    sources = edit_cells(chapter, sample)
    variables: dict[str, object] = {}
    with (
        patch.object(labkit, "read_log", read_once),
        patch.object(odometry, "estimate_odometry", run_once),
    ):
        for cell in cells_needed(sources, set(cells)):
            code = compile(sources[cell], f"chapter {chapter}, cell {cell}", "exec")
            exec(code, variables)
    plt.close("all")
    return variables


def edit_cells(chapter: str, sample: dict[str, str]) -> dict[str, str]:
    """The code of a chapter's cells with the edits of a sample; raises where one does not apply."""
    sources = code_of(chapter)
    for passage, replacement in sample.items():
        edited = [cell for cell, source in sources.items() if passage in source]
        assert edited, f"no cell of chapter {chapter} holds {passage!r}"
        for cell in edited:
            sources[cell] = sources[cell].replace(passage, replacement)
    return sources


@cache
def killian() -> Log:
    """The log of nearly all chapters, which no cell can change."""
    log = read_log("killian")
    log.stamps.setflags(write=False)
    log.reference.setflags(write=False)
    return log


def read_once(name: str) -> Log:
    """A log; Killian's is read once for all claims."""
    return killian() if name == "killian" else read_log(name)


RUNS: dict[bytes, OdometryResult] = {}  # over all of Killian's scans, by the other arguments


def run_once(scans: Any, *prior: Any, **options: Any) -> OdometryResult:
    """The odometry over some scans; over all of Killian's it runs once with the same arguments."""
    if scans is not killian().scans:
        return estimate_odometry(scans, *prior, **options)
    silent = {name: value for name, value in options.items() if name != "progress"}
    key = pickle.dumps((prior, sorted(silent.items())))
    if key not in RUNS:
        RUNS[key] = estimate_odometry(scans, *prior, **options)
        RUNS[key].poses.setflags(write=False)
    return RUNS[key]


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


def cells_needed(sources: dict[str, str], cells: set[str]) -> list[str]:
    """These cells, and before them those that set or change what they read, in order."""
    assert cells <= set(sources), cells - set(sources)
    unset: set[str] = set()  # variables that the cells chosen so far read
    chosen = []
    for cell in reversed(sources):
        reads, sets, changes = variables_of(sources[cell])
        if cell in cells or (sets | changes) & unset:
            chosen.append(cell)
            unset = unset - sets | reads | changes
    return chosen[::-1]


def variables_of(source: str) -> tuple[set[str], set[str], set[str]]:
    """The variables that a cell reads, those that it sets, and those that it changes in place."""
    scopes = [symtable.symtable(source, "cell", "exec")]
    sets = {
        symbol.get_name()
        for symbol in scopes[0].get_symbols()
        if symbol.is_assigned() or symbol.is_imported()
    }
    for scope in scopes:
        scopes += scope.get_children()  # of its functions, and so on
    reads = {
        symbol.get_name()
        for scope in scopes
        for symbol in scope.get_symbols()
        if symbol.is_referenced() and symbol.is_global()
    }
    changes = set(re.findall(rf"(?m)^ *(\w+)(?:\[.*?\] \|?= |\.(?:{CHANGING})\()", source))
    return reads - sets, sets, changes
