"""How far a loop is: a bar in a terminal, a line every ten seconds elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sized
from typing import TypeVar

from tqdm import tqdm

Item = TypeVar("Item")
SECONDS_BETWEEN_LINES = 10.0  # [s] between two lines


def show_progress(
    items: Iterable[Item], doing: str, *, unit: str = "", total: int | None = None
) -> Iterable[Item]:
    """Go through `items` and show on stderr how far: ``matching: 1200 of 3873 scans``."""
    if total is None and isinstance(items, Sized):
        total = len(items)
    if sys.stderr.isatty():
        bar: Iterable[Item] = tqdm(items, doing, total, unit=unit or "it")
        return bar
    return _print_lines(items, doing, unit, total)


def _print_lines(items: Iterable[Item], doing: str, unit: str, total: int | None) -> Iterator[Item]:
    of_all = "" if total is None else f" of {total}"
    plural = f" {unit}s" if unit else ""
    due = time.monotonic() + SECONDS_BETWEEN_LINES
    for count, item in enumerate(items):
        if time.monotonic() >= due:
            sys.stderr.write(f"{doing}: {count}{of_all}{plural}\n")
            sys.stderr.flush()
            due = time.monotonic() + SECONDS_BETWEEN_LINES
        yield item
