"""What looks at the pages sees what it must complain of."""

from __future__ import annotations

import pytest

from tests.book.widget_page import opened

FAULTS = {
    "a file from elsewhere": '<img src="https://elsewhere.invalid/picture.png">',
    "a file that is missing": '<img src="missing.png">',
    "an error on the console": "<script>console.error('told')</script>",
    "an exception": "<script>throw new Error('thrown')</script>",
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_page_with_a_fault_is_refused(browser, tmp_path, fault):
    page = tmp_path / "page.html"
    page.write_text(f"<!doctype html><title>page</title>{fault}", "utf-8")

    with pytest.raises(AssertionError), opened(browser, page.as_uri()):
        pass


def test_a_page_without_a_fault_is_not(browser, tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<!doctype html><title>page</title>", "utf-8")

    with opened(browser, page.as_uri()):
        pass
