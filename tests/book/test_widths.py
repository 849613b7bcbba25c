"""Every page at every width of a window: nothing sticks out, and nothing jumps."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import pytest

from tests.book.test_pages import NAMES
from tests.book.widths import (
    MAX_SHIFT,
    SHIFT_WIDTHS,
    WIDTHS,
    QuietHandler,
    measure,
    served,
    watched_page,
)

pytestmark = pytest.mark.pages


@pytest.fixture(scope="module")
def base(html: Path) -> Iterator[str]:
    with served(html) as address:
        yield address


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NAMES, "genindex"])
def test_a_page_fits_each_window_and_stands_still(browser, base, name):
    """Buys the widths between a telephone and a desk, and what jumps while it loads."""
    pixels, shifts = measure(browser, f"{base}/{name}.html")

    assert pixels == dict.fromkeys(WIDTHS, 0)
    assert {width: shift for width, shift in shifts.items() if shift > MAX_SHIFT} == {}


class HaltingHandler(QuietHandler):
    """Sends a page with a break before the last row of each table, in which it can be seen."""

    def copyfile(self, source: BinaryIO, outputfile: BinaryIO) -> None:
        """Send what was asked for."""
        for part in re.split(rb"(?=<tr(?:(?!<tr).)*</tbody>)", source.read(), flags=re.DOTALL):
            outputfile.write(part)
            outputfile.flush()
            time.sleep(1 if part.rstrip().endswith(b"</tr>") else 0)


def test_a_table_whose_rows_arrive_late_stands_still(browser, html):
    """Buys columns that a late row widens, under the eyes of who reads those before it."""
    with served(html, HaltingHandler) as base:
        page = watched_page(browser, SHIFT_WIDTHS[-1], 1000)
        page.goto(f"{base}/book/formats.html", wait_until="networkidle")
        moved = page.evaluate("() => window.shifts.flatMap(shift => shift[2])")
        page.close()

    assert "TD" not in moved
