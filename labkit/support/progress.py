"""Progress on standard error: a bar in a terminal, elsewhere a line every ten seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

from tqdm import tqdm

T = TypeVar("T")
PAUSE = 10.0  # seconds between two lines in a log


def progress(items: Iterable[T], *, what: str, total: int | None = None) -> Iterator[T]:
    """The same items; tells how many were taken so far."""
    if sys.stderr.isatty():
        yield from tqdm(items, desc=what, total=total)
        return
    due = time.monotonic() + PAUSE
    for count, item in enumerate(items, start=1):
        yield item
        if time.monotonic() >= due:
            sys.stderr.write(f"{what}: {count}{f' of {total}' if total else ''}\n")
            due = time.monotonic() + PAUSE
