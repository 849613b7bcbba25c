"""The book in a second engine: pages and their widgets in Firefox."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from firefox import Firefox
from test_pages import LACKING

pytestmark = pytest.mark.others


@pytest.fixture(scope="module")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    """The machine's own; in CI its absence is a failure, elsewhere a skip."""
    path = shutil.which("firefox-esr") or shutil.which("firefox")
    if path is None:
        missing = "no Firefox here; on Debian: `sudo apt install firefox-esr`"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(missing)
    firefox = Firefox(path, tmp_path_factory.mktemp("profile"))
    yield firefox
    firefox.close()


# Firefox draws a page while it comes, and complains of a formula that is only half there.
HALF_READ = "Invalid markup: Incorrect number of children"
UNFINISHED = """() => [...document.querySelectorAll("msubsup, munderover")]
    .filter(each => each.children.length !== 3).length"""


UNDRAWN = "() => document.querySelectorAll('.widget-subarea:not(:has(canvas))').length"


@pytest.mark.parametrize(
    "name", ["book/intro", "book/explorer", "book/drive", "notebooks/02_alignment"]
)
def test_firefox_draws_a_page(firefox: Firefox, html: Path, name: str):
    firefox.open(f"{html.as_uri()}/{name}.html")
    firefox.evaluate("() => window.drawWidgets?.()")
    assert firefox.evaluate(UNDRAWN) == 0
    assert firefox.evaluate(LACKING) == []
    unloaded = "() => [...document.images].filter(i => !i.naturalWidth).map(i => i.src)"
    assert firefox.evaluate(unloaded) == []
    assert firefox.evaluate(UNFINISHED) == 0  # what Firefox says of a formula half read is past
    assert [said for said in firefox.complaints() if HALF_READ not in said] == []
