"""How far each page of a built book scrolls sideways, and how much of it jumps.

python -m tests.book.widths [FOLDER OF THE BOOK]

Each page is loaded over http as a reader loads it, with its animations, and scrolled once from
its head to its end. The table says how many pixels it is too wide at each width, and its layout
shift: the share of the screen that moved, times how far, added up.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

from tests.book.widget_page import PATIENCE, promised
from tests.tools.installed import program

WIDTHS = (390, 768, 992, 1024, 1280, 1366, 1440)  # of a window [px]
SHIFT_WIDTHS = (390, 1366)
MAX_SHIFT = 0.02  # share of the screen times share of its height that may jump
HEIGHTS = {390: 844}  # of a window [px]; 800 where none is named
WAIT_MS = 60  # at each screen; for widgets that come near, as long as they are drawn
WATCH_SHIFTS = """() => {
    window.shifts = [];
    new PerformanceObserver(list => {
        for (const entry of list.getEntries()) {
            if (entry.hadRecentInput) continue;
            const nodes = entry.sources.map(source => source.node?.nodeName);
            window.shifts.push([entry.value, entry.startTime, nodes]);
        }
    }).observe({ type: "layout-shift", buffered: true });
}"""
SCROLL_TO = "top => scrollTo({ top, behavior: 'instant' })"
IS_NEAR_DRAWN = """() => [...document.querySelectorAll(".widget-subarea:empty")]
    .every(widget => widget.getBoundingClientRect().top >= 2 * innerHeight)"""
OVERFLOW = """() => new Promise(done => requestAnimationFrame(() => setTimeout(
    () => done(document.documentElement.scrollWidth - document.documentElement.clientWidth))))"""


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves files without a line for each."""

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@contextmanager
def served(folder: Path, handler: type[QuietHandler] = QuietHandler) -> Iterator[str]:
    """Address of a server that shows a folder."""
    show = partial(handler, directory=str(folder))
    ThreadingHTTPServer.handle_error = lambda *_: None  # a page that is closed asks no more
    with ThreadingHTTPServer(("127.0.0.1", 0), show) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def overflows(page: Page) -> dict[int, int]:
    """Pixels by which an open page is too wide, by the width of the window."""
    pixels = {}
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": HEIGHTS.get(width, 800)})
        pixels[width] = promised(page, OVERFLOW)
    return pixels


def jumps(page: Page) -> float:
    """Layout shift of an open page that is scrolled once, `WATCH_SHIFTS` being told before."""
    top, end = 0, 1
    while top < end:
        page.evaluate(SCROLL_TO, top)
        page.wait_for_timeout(WAIT_MS)
        page.wait_for_function(IS_NEAR_DRAWN, polling=WAIT_MS)
        top += page.viewport_size["height"] // 2
        end = page.evaluate("() => document.documentElement.scrollHeight")
    page.wait_for_timeout(500)
    return shift_of(page)


def shift_of(page: Page) -> float:
    """Layout shift of an open page up to now, `WATCH_SHIFTS` being told before."""
    return sum(value for value, *_ in page.evaluate("() => window.shifts"))


def watched_page(browser: Browser, width: int, height: int) -> Page:
    """An empty page in a window of this size [px], on which all that jumps is noted."""
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE)
    page.add_init_script(f"({WATCH_SHIFTS})()")
    return page


def measure(browser: Browser, address: str) -> tuple[dict[int, int], dict[int, float]]:
    """Overflow [px] of a page by the width of the window, and its layout shift at two of them."""
    shifts = {}
    for width in SHIFT_WIDTHS:
        page = watched_page(browser, width, HEIGHTS.get(width, 800))
        page.goto(address, wait_until="networkidle")
        shifts[width] = jumps(page)
        if width == SHIFT_WIDTHS[-1]:
            pixels = overflows(page)
        page.close()
    return pixels, shifts


def main(html: Path) -> None:
    """Print a row of figures for each page."""
    names = sorted(path.relative_to(html).as_posix() for path in html.rglob("*.html"))
    columns = [*WIDTHS, *(f"jump {width}" for width in SHIFT_WIDTHS)]
    print("page".ljust(34), *(f"{column:>9}" for column in columns))
    path = program("chromium", "chromium", "chromium-browser", "google-chrome")
    with served(html) as base, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name in names:
            if name.startswith("_static"):
                continue
            pixels, shifts = measure(browser, f"{base}/{name}")
            figures = [f"{p:9d}" for p in pixels.values()] + [f"{s:9.3f}" for s in shifts.values()]
            print(name.ljust(34), *figures, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1] if sys.argv[1:] else "_build/html"))
