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
    numbered = dict(enumerate(samples))
    if os.environ.get("LABKIT_EXAMPLES") != "nightly":
        today = zlib.crc32(commit()) % len(samples)
        numbered = {today: samples[today]}
    return pytest.mark.parametrize("sample", numbered.values(), ids=map(str, numbered))


def commit() -> bytes:
    """The name of the commit that is tried; nothing where there is no repository."""
    asked = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
    return subprocess.run(asked, capture_output=True, check=False).stdout


def run_cells(chapter: str, sample: dict[str, str], *asked: str) -> dict[str, object]:
    """The names that the asked cells of a chapter set, run with the edits of a sample.

    Before them run the cells that set what they need. Each edit has to apply.
    """
    cells = code_of(chapter)
    for old, new in sample.items():
        holding = [name for name, source in cells.items() if old in source]
        assert holding, f"no cell of chapter {chapter} holds {old!r}"
        cells |= {name: cells[name].replace(old, new) for name in holding}
    names: dict[str, object] = {}
    with (
        patch.object(labkit, "read_log", read_once),
        patch.object(odometry, "estimate_odometry", run_once),
    ):
        for name in needed(cells, set(asked)):
            exec(compile(cells[name], f"chapter {chapter}, cell {name}", "exec"), names)
    plt.close("all")
    return names


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


RUNS: dict[bytes, OdometryResult] = {}  # over all of Killian's scans, by what they were given


def run_once(scans: Any, *given: Any, **options: Any) -> OdometryResult:
    """The odometry over some scans; over all of Killian's it runs once with the same arguments."""
    if scans is not killian().scans:
        return estimate_odometry(scans, *given, **options)
    heard = {name: value for name, value in options.items() if name != "progress"}
    arguments = pickle.dumps((given, sorted(heard.items())))
    if arguments not in RUNS:
        RUNS[arguments] = estimate_odometry(scans, *given, **options)
        RUNS[arguments].poses.setflags(write=False)
    return RUNS[arguments]


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


def needed(cells: dict[str, str], asked: set[str]) -> list[str]:
    """The asked cells, and before them those that set or change what they read, in order."""
    assert asked <= set(cells), asked - set(cells)
    wanted: set[str] = set()
    kept = []
    for name in reversed(cells):
        reads, sets, changes = flow(cells[name])
        if name in asked or (sets | changes) & wanted:
            kept.append(name)
            wanted = wanted - sets | reads | changes
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
