"""Every page at every width of a window: nothing sticks out, and nothing jumps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.book.test_pages import NAMES
from tests.book.widths import MAX_SHIFT, WIDTHS, measure, served

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
