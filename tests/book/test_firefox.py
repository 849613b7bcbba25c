"""The book in a second engine: pages and explorer in Firefox."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("anywidget")
pytest.importorskip("rtbdata")
pytest.importorskip("websocket")

from firefox import Firefox
from test_pages import LACKING
from widget_page import written_page

from labkit.interactive import icp_explorer

pytestmark = pytest.mark.others

RIGHT = "\ue014"  # the arrow key, in WebDriver's table
DRAWN = """async () => {
    await window.drawWidgets();
    while (!document.querySelector(".icp-readouts dd")) await new Promise(requestAnimationFrame);
}"""
READ = """async () => {
    await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
    const slider = document.querySelector("input[name=overlap_ratio]");
    return [slider.ariaValueText, document.querySelector(".icp-sentence").textContent];
}"""
FOCUS = "() => document.querySelector('input[name=overlap_ratio]').focus()"


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


@pytest.mark.parametrize("name", ["book/intro", "notebooks/02_alignment"])
def test_firefox_draws_a_page(firefox: Firefox, html: Path, name: str):
    firefox.open(f"{html.as_uri()}/{name}.html")
    firefox.evaluate("() => window.drawWidgets?.()")
    assert firefox.evaluate("() => document.querySelectorAll('article .math').length") > 0
    assert firefox.evaluate(LACKING) == []
    unloaded = "() => [...document.images].filter(i => !i.naturalWidth).map(i => i.src)"
    assert firefox.evaluate(unloaded) == []
    assert firefox.evaluate(UNFINISHED) == 0  # what Firefox says of a formula half read is past
    assert [said for said in firefox.complaints() if HALF_READ not in said] == []


def test_firefox_moves_a_slider_and_the_numbers_follow(firefox: Firefox, tmp_path: Path):
    firefox.open(written_page(icp_explorer(), tmp_path))
    firefox.evaluate(DRAWN)
    share, count = firefox.evaluate(READ)
    firefox.evaluate(FOCUS)
    firefox.press(RIGHT)
    by_key = firefox.evaluate(READ)
    assert float(by_key[0]) > float(share)
    assert by_key[1] != count
    assert firefox.complaints() == []
