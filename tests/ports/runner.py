"""Hold every port to the vectors: ``python -m tests.ports.runner [NAME ...]``.

Builds each port into a temporary folder, has it answer all vectors in one process, and
prints how many answers of each group agree, and why the others do not. The status is 1
where one does not, or where a port is missing its tools.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import zip_longest
from pathlib import Path
from typing import Any

from tests.conformance.compare import disagreement
from tests.conformance.reference import answer, read_files
from tests.ports.ports import PORTS, BuildError, Port, execute

CONFORMANCE = Path(__file__).parents[1] / "conformance"
VECTORS: list[dict[str, Any]] = json.loads((CONFORMANCE / "vectors.json").read_text())
FILES = read_files(CONFORMANCE, [vector["command"] for vector in VECTORS])
NAMES = tuple(vector["name"] for vector in VECTORS)
GROUPS = tuple(dict.fromkeys(vector["group"] for vector in VECTORS))
LABKIT_TOLERANCE = 1e-12  # against itself: another BLAS sums in another order
Reasons = dict[str, str | None]  # why a vector is not agreed with, by its name


def reasons(
    port: Port,
    folder: Path,
    sources: Path | None = None,
    names: Collection[str] = NAMES,
    build: Callable[[Path, Path], None] | None = None,
) -> Reasons:
    """Build `port` into `folder` and hold it to those of the named vectors that it can take."""
    sources = sources or port.sources
    folder.mkdir(parents=True, exist_ok=True)
    (build or port.build)(sources, folder)
    asked = [
        vector
        for vector in VECTORS
        if vector["name"] in names and distances(vector) <= port.most_distances
    ]
    commands = folder / "commands.txt"
    commands.write_text("".join(" ".join(vector["command"]) + "\n" for vector in asked))
    (folder / "data").symlink_to(CONFORMANCE / "data")
    outcome = execute([*port.start(sources, folder), "batch", commands])
    told = (outcome.stderr.strip() or "nothing on standard error").splitlines()[-1]
    ended = f"no answer: the batch ended with status {outcome.returncode}, {told}"
    found = {
        vector["name"]: ended if line is None else _disagreement(line, vector["expected"])
        for vector, line in zip_longest(asked, outcome.stdout.splitlines()[: len(asked)])
    }
    return found if outcome.returncode == 0 else dict.fromkeys(found, ended)


def distances(vector: dict[str, Any]) -> int:
    """How many distances between points a search by brute force takes for a vector."""
    if vector["command"][0] != "match":
        return 0
    target, source = (len(FILES[path]) for path in vector["command"][1:3])
    return target * source * (1 + vector["expected"]["iterations"])


def _disagreement(line: str, expected: dict[str, Any]) -> str | None:
    try:
        received = json.loads(line, parse_constant=_no_json)
    except ValueError as mistake:
        return f"{line!r:.80} is no JSON: {mistake}"
    return disagreement(received, expected)


def _no_json(word: str) -> float:
    raise ValueError(f"{word} is no number in JSON")


def labkit_reasons() -> Reasons:
    """What labkit answers today, against what it wrote."""
    return {
        vector["name"]: disagreement(
            answer(vector["command"], FILES), vector["expected"], LABKIT_TOLERANCE
        )
        for vector in VECTORS
    }


def table(columns: dict[str, Reasons | str]) -> str:
    """Group × language → agreed / all; a word stands for a column that could not run."""
    rows = [["", *columns]]
    for group in (*GROUPS, "all"):
        names = [vector["name"] for vector in VECTORS if group in (vector["group"], "all")]
        cells = [
            column if isinstance(column, str) else _score(column, names)
            for column in columns.values()
        ]
        rows.append([group, *cells])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _score(column: Reasons, names: Sequence[str]) -> str:
    asked = [column[name] for name in names if name in column]
    score = f"{asked.count(None)}/{len(asked)}"
    return score if len(asked) == len(names) else f"{score} ({len(names) - len(asked)} not asked)"


def main(names: Sequence[str]) -> int:
    """Print the table, then every disagreement; 0 where there is none."""
    unknown = set(names) - {port.name for port in PORTS}
    if unknown:
        sys.exit(f"no port is named {', '.join(sorted(unknown))}")
    chosen = [port for port in PORTS if not names or port.name in names]
    columns: dict[str, Reasons | str] = {"labkit": labkit_reasons()}
    notes = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor() as pool:
        running = {
            port: pool.submit(reasons, port, Path(folder) / port.name)
            for port in chosen
            if port.missing is None
        }
        for port in chosen:
            try:
                columns[port.language] = running[port].result() if port in running else "missing"
            except BuildError as error:
                columns[port.language] = "no build"
                notes.append(f"{port.language}: {error}")
            if port.missing:
                notes.append(port.missing)
    for language, column in columns.items():
        if isinstance(column, dict):
            notes += [f"{language}, {name}: {why}" for name, why in column.items() if why]
    print(table(columns))
    print("".join(f"\n{note}" for note in notes), end="\n" if notes else "")
    return 1 if notes else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
