"""A page that holds one widget, as a page of the book does, and the browser's eye on it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from anywidget import AnyWidget
from ipywidgets.embed import embed_data
from playwright.sync_api import Browser, Locator, Page, expect

PATIENCE = 1000.0 * float(os.environ.get("LABKIT_PATIENCE", "86400"))  # of a wait [ms]
LEFT = "net::ERR_ABORTED"  # a request whose page went elsewhere; a file that is missing says so
FRAME = 20  # ms of a page's clock in which it draws at least once
# Formulas without a drawing, or with one of no size, letters without a shape, pictures that did
# not come, widgets that drew nothing, and figures without a place, once all have been asked.
UNDRAWN = """async () => {
    window.drawWidgets?.();
    const later = () => new Promise(r => setTimeout(r, 100));
    const empty = ".widget-subarea:not(:has(canvas))";
    while (document.querySelector(empty)) await later();
    const isDrawn = each => each.querySelector(":scope > svg")
        && (!each.checkVisibility() || each.firstElementChild.getBoundingClientRect().width > 0);
    const lacking = (places, hasAll) => [...document.querySelectorAll(places)]
        .filter(each => !hasAll(each)).map(each => each.outerHTML.slice(0, 400));
    return [
        ...lacking("article .math", isDrawn),
        ...lacking("article .math use", each => document.querySelector(each.getAttribute("href"))),
        ...lacking("main img", each => each.complete && each.naturalWidth),
        ...lacking(".widget-subarea", each => each.querySelector("canvas")),
        ...lacking("article :is(figure, .cell_output img, .icp-explorer)",
            each => each.closest("details, .still") || each.offsetHeight >= 40),
    ];
}"""


def written_page(widget: AnyWidget, folder: Path) -> str:
    """A page that shows the widget as it is now; it loads the book's own files for widgets."""
    book = (Path(__file__).parents[2] / "book" / "_static").as_uri()
    data = embed_data(views=[widget], drop_defaults=False)
    state, view = json.dumps(data["manager_state"]), json.dumps(data["view_specs"][0])
    kinds = "application/vnd.jupyter.widget-state+json", "application/vnd.jupyter.widget-view+json"
    page = folder / "page.html"
    page.write_text(
        '<!doctype html><html lang="en" data-content_root="./"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>page</title>'
        f'<script src="{book}/widgets.js"></script><body><main style="max-width: 720px">'
        + f'<script type="{kinds[0]}">{state}</script><script type="{kinds[1]}">{view}</script>',
        "utf-8",
    )
    return page.as_uri()


def promised(page: Page, script: str, arg: object = None) -> Any:
    """What a script promises, by the end of the page's patience; `page.evaluate` knows no end."""
    return page.wait_for_function(f"async arg => [await ({script})(arg)]", arg=arg).json_value()[0]


def repeat_until(is_there: Callable[[], bool], act: Callable[[], object], what: str) -> None:
    """Act until it is there; once the patience is at its end, say for what."""
    end = time.monotonic() + PATIENCE / 1000.0
    while not is_there():
        assert time.monotonic() < end, f"waited {PATIENCE / 1000.0:g} s for {what}"
        act()


def settle(page: Page) -> None:
    """Let the page draw what has happened."""
    promised(page, "() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")


def readout(page: Page, name: str) -> Locator:
    """A number that a widget tells."""
    return page.locator(f"[data-readout='{name}']")


def picture(page: Page, canvas: str = ".icp-plane") -> str:
    """What is drawn, once all that has happened shows in it."""
    settle(page)
    return drawn(page, canvas)


def drawn(page: Page, canvas: str = ".icp-plane") -> str:
    """What is drawn now."""
    shown: str = page.locator(canvas).first.evaluate("canvas => canvas.toDataURL()")
    return shown


def film(page: Page, duration: int, canvas: str = ".icp-plane") -> list[str]:
    """What is drawn, frame by frame for so many ms, on a page whose clock moves by hand."""
    pictures = []
    for _ in range(duration // FRAME):
        page.clock.run_for(FRAME)
        pictures.append(drawn(page, canvas))
    return pictures


def run_until(page: Page, place: str, words: str) -> None:
    """Move a page's clock by hand until these words stand there."""
    there = page.locator(place)
    repeat_until(
        lambda: words in there.inner_text(), lambda: page.clock.run_for(FRAME), f"{words!r}"
    )


def enter(page: Page, address: str) -> None:
    """Open an address as if from elsewhere, though it may be another place of the same page."""
    page.goto("about:blank")
    page.goto(address)


def copied_link(page: Page, button: str, where: str) -> str:
    """The link that a button puts into the clipboard, which is told in a line below it."""
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_role("button", name=button).click()
    expect(page.locator(where).first).to_contain_text("clipboard")
    link: str = page.evaluate("() => navigator.clipboard.readText()")
    return link


def come_back(page: Page, kept: str = "") -> None:
    """Load the page again, as a reader does who comes back, once it has kept what is said."""
    page.wait_for_function("told => JSON.stringify({ ...localStorage }).includes(told)", arg=kept)
    page.reload(wait_until="networkidle")


@contextmanager
def opened(
    browser: Browser,
    address: str,
    sign: str = "",
    own: str = "file:",
    by_hand: bool = False,
    **options: object,
) -> Iterator[Page]:
    """A page, once the sign is there; on leaving, it asked for its own alone and nothing failed.

    What it was still waiting for when the test went to another address has not failed.
    `by_hand`: its clock stands, and moves by `page.clock.run_for` alone, however fast the machine.
    """
    page = browser.new_page(**options)
    page.set_default_timeout(PATIENCE)
    if by_hand:
        page.clock.install(time=0)
        page.clock.pause_at(1)
    outside: list[str] = []
    complaints: list[str] = []
    known = (own, "data:", "blob:")
    page.on("request", lambda r: None if r.url.startswith(known) else outside.append(r.url))
    page.on(
        "requestfailed",
        lambda r: None if r.failure == LEFT else complaints.append(f"{r.url}: {r.failure}"),
    )
    page.on("response", lambda r: complaints.append(r.url) if r.status >= 400 else None)
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: complaints.append(str(e)))
    page.goto(address)
    if by_hand:
        there = page.locator(sign)
        repeat_until(lambda: there.count() > 0, lambda: page.clock.run_for(FRAME), sign)
    elif sign:
        page.locator(sign).first.wait_for()
    else:
        page.wait_for_load_state("networkidle")
    yield page
    page.close()
    assert not outside, outside  # told here: pytest rewrites the asserts of test files alone
    assert not complaints, complaints
