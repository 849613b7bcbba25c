"""Gradebooks in CSV, filled in and otherwise left as the platform wrote them."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from labkit.errors import LabkitError
from labkit.logs.atomic import atomic_write

FORMULA = (*"=+-@", *"＝＋－＠", "\t", "\r", "\n")  # the wide ones where people type Chinese
Row = list[str]
Rows = list[Row]


def read_gradebook(path: str | os.PathLike[str], columns: Sequence[str]) -> Rows:
    """The rows of a gradebook, header first, every row as long as the header.

    Raises
    ------
    LabkitError
        Where it cannot be read, or lacks one of `columns`; the message lists what it has.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise LabkitError(f"{path}: is no UTF-8 text; export the gradebook as CSV") from None
    except OSError as error:
        raise LabkitError(f"{path}: cannot be read: {error.strerror}") from None
    try:
        rows = [row for row in csv.reader(text.splitlines(keepends=True), strict=True) if row]
    except csv.Error as error:
        raise LabkitError(f"{path}: is no CSV file: {error}") from None
    if not rows:
        raise LabkitError(f"{path}: the gradebook is empty; export it again")
    header = [name.strip() for name in rows[0]]
    missing = [name for name in columns if name not in header]
    if missing:
        raise LabkitError(
            f"{path}: line 1: no column {missing[0]!r}; the columns are {', '.join(header)}"
        )
    for line, row in enumerate(rows, 1):
        if len(row) > len(header):
            raise LabkitError(f"{path}: row {line} has {len(row)} cells, the header {len(header)}")
    return [header, *(row + [""] * (len(header) - len(row)) for row in rows[1:])]


def write_gradebook(path: str | os.PathLike[str], rows: Iterable[Sequence[str]]) -> None:
    """Write rows as CSV, whole or not at all."""
    with atomic_write(path) as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def plain(text: str) -> str:
    """Text that no spreadsheet takes for a formula.

    >>> plain("=1+1"), plain("＝1+1"), plain("well done")
    ("'=1+1", "'＝1+1", 'well done')
    """
    return "'" + text if text.startswith(FORMULA) else text
