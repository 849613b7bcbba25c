"""Tables that people and platforms made, and those that go back to them: CSV in UTF-8."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from labkit.support.errors import LabkitError
from labkit.support.files import atomic_write

Row: TypeAlias = dict[str, str]
FORMULA = (*"=+-@", *"＝＋－＠", "\t", "\r", "\n")  # the wide ones where people type Chinese


def read_rows(
    path: str | os.PathLike[str], needed: Sequence[str], way_out: str = ""
) -> tuple[Sequence[str], list[tuple[int, Row]]]:
    """Read the columns of a table, and its rows with their lines.

    Where a `needed` column is missing, the message ends with the `way_out`.
    """
    try:
        content = Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise LabkitError(f"{path}: is no UTF-8 text; save it as CSV in UTF-8") from None
    except OSError as error:
        raise LabkitError(f"{path}: cannot be read: {error.strerror}") from None
    header, *_ = lines = content.splitlines(keepends=True) or [""]
    delimiter = ";" if ";" in header and "," not in header else ","  # Excel's, where 0.5 is 0,5
    reader = csv.DictReader(lines, delimiter=delimiter, restval="", strict=True)
    rows = []
    try:
        columns = reader.fieldnames = [name.strip() for name in reader.fieldnames or []]
        for row in reader:
            if None in row:
                raise csv.Error("it has more cells than line 1")
            cells = {name: cell.strip() for name, cell in row.items()}
            if any(cells.values()):
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise LabkitError(
            f"{path}: line {reader.reader.line_num}: {error}; put text that holds a comma in "
            f"double quotes, and close each quote"
        ) from None
    for name in needed:
        if name not in columns:
            present = ", ".join(columns) or "none"
            raise LabkitError(
                f"{path}: line 1: no column {name!r}; the columns are {present}{way_out}"
            )
    return columns, rows


def write_rows(
    path: str | os.PathLike[str], columns: Sequence[str], rows: Iterable[Mapping[str, str]]
) -> None:
    """Write some columns of rows as CSV, whole or not at all."""
    with atomic_write(path) as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def number(cell: str) -> float:
    """The number in a cell, with a point or a comma; nan where there is none."""
    try:
        return float(cell.replace(",", ".").replace("_", " "))  # 1_0 is no number to people
    except ValueError:
        return math.nan


def plain(cell: str) -> str:
    """Text that no spreadsheet takes for a formula."""
    return "'" + cell if cell.startswith(FORMULA) else cell
