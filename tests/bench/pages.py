"""How heavy and how fast the built book is in a browser, by page and by slider.

    python tests/bench/pages.py [PAGE ...] [--lab]

It opens the pages of `make book` in Chromium, each from its folder and with nothing cached, on a
processor slowed down four times, and prints their weight, the time to the largest paint, how long
scripts blocked the page, and its long tasks (over 50 ms): how many, all of them together, and the
longest. Then, at full speed, it moves every slider and every scan, by
keyboard and by mouse, and prints the median time from an input to the picture that it changes.
With `--lab` it moves the same ones in the notebooks, run in a JupyterLab; that takes minutes.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from urllib.parse import unquote, urlsplit

from playwright.sync_api import Browser, Locator, Page, sync_playwright

sys.path.append(str(Path(__file__).parents[2]))
from tests.book.jupyterlab_page import CLOSE, OPEN, READY, RUN_ALL, jupyterlab

ROOT = Path(__file__).parents[2]
BUILT = ROOT / "_build" / "html"
SLOWER = 4
QUIET = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
STEPS = 15  # of each control, by each device
WIDGETS = ".icp-explorer"
OBSERVE = """() => {
    window.seen = { largest: 0, tasks: [] };
    const watch = (type, note) => new PerformanceObserver(list =>
        list.getEntries().forEach(note)).observe({ type, buffered: true });
    watch("largest-contentful-paint", each => { seen.largest = each.startTime; });
    watch("longtask", each => seen.tasks.push([each.startTime, each.duration]));
}"""
IS_QUIET = """() => document.readyState === "complete" && performance.now() - 1500 >
    Math.max(0, ...seen.tasks.map(([start, duration]) => start + duration))"""
COST = """() => {
    const [first] = performance.getEntriesByName("first-contentful-paint");
    const late = seen.tasks.filter(([start]) => start >= first.startTime);
    const times = seen.tasks.map(([, duration]) => duration);
    const sum = all => all.reduce((a, b) => a + b, 0);
    const blocked = sum(late.map(([, duration]) => duration - 50));
    return [seen.largest, blocked, sum(times), Math.max(0, ...times)].map(each => each / 1e3)
        .concat(times.length);
}"""
# An event is over when the frame that it asked for is handed on; pictures are decoded by then.
STOPWATCH = """widget => {
    window.delays = [];
    let since = null;
    const drawn = () => {
        if (![...widget.querySelectorAll("img")].every(each => each.complete))
            return requestAnimationFrame(drawn);
        const { port1, port2 } = new MessageChannel();
        port1.onmessage = () => { delays.push(performance.now() - since); since = null; };
        port2.postMessage(null);
    };
    const note = event => {
        if (since !== null || event.type === "pointermove" && event.buttons === 0) return;
        if (event.target.type === "range" && event.type !== "input") return;
        since = event.timeStamp;
        requestAnimationFrame(drawn);
    };
    for (const type of ["input", "pointermove", "keydown"])
        widget.addEventListener(type, note, true);
}"""
TWO_FRAMES = "() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
DRAW_ALL = """async () => {
    document.querySelectorAll("details").forEach(each => { each.open = true; });
    await window.drawWidgets?.();
}"""


def names() -> list[str]:
    """The built pages, as they are named in `_toc.yml`."""
    pages = sorted([*BUILT.glob("notebooks/*.html"), *BUILT.glob("book/*.html")])
    if not pages:
        sys.exit(f"{BUILT} has no pages; run `make book` first")
    return [page.relative_to(BUILT).with_suffix("").as_posix() for page in pages]


def weigh(browser: Browser, name: str) -> list[float]:
    """Megabytes of a page with all that it loads, and what `COST` tells of it, in seconds."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    loaded: set[Path] = set()
    page.on("request", lambda r: loaded.add(Path(unquote(urlsplit(r.url).path))))
    page.add_init_script(f"({OBSERVE})()")
    page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": SLOWER})
    page.goto((BUILT / f"{name}.html").as_uri())
    page.wait_for_function(IS_QUIET, timeout=120_000, polling=200)
    cost = page.evaluate(COST)
    page.evaluate(DRAW_ALL)
    page.close()
    return [sum(each.stat().st_size for each in loaded if each.is_file()) / 1e6, *cost]


def responses(page: Page, root: Locator) -> Iterator[tuple[str, float, float]]:
    """Each control of the widgets below `root`: its name, and its delays by mouse and by keys."""
    for widget in root.locator(WIDGETS).all():
        if not widget.is_visible():
            continue
        widget.evaluate(STOPWATCH)
        for control in widget.locator("input[type=range], canvas[tabindex]").all():
            if not (control.is_visible() and control.is_enabled()):
                continue
            for reset in widget.get_by_role("button", name="Reset").all():
                reset.click()  # the control before may have left a run of no iteration
            is_map = control.evaluate("node => node.tagName") == "CANVAS"
            name = "the scan" if is_map else control.evaluate("node => node.labels[0].textContent")
            by_mouse = timed(page, lambda c=control, m=is_map: drag(page, c, m))
            yield name, by_mouse, timed(page, lambda c=control: press(page, c))


def timed(page: Page, act: Callable[[], None]) -> float:
    """The median delay of what `act` does."""
    page.evaluate("() => { delays.length = 0; }")
    act()
    delays = page.evaluate("() => delays")
    return median(delays) if delays else float("nan")


def drag(page: Page, control: Locator, is_map: bool) -> None:
    """Take a scan by its middle, or a slider by its left end, and move it to the right."""
    control.evaluate("node => node.scrollIntoView({ block: 'center', behavior: 'instant' })")
    box = control.bounding_box()
    assert box is not None
    x, y = box["x"] + (box["width"] / 2 if is_map else 8), box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, STEPS + 1):
        page.mouse.move(x + k * (4 if is_map else (box["width"] - 16) / STEPS), y)
        page.evaluate(TWO_FRAMES)
    page.mouse.up()


def press(page: Page, control: Locator) -> None:
    """Move it by arrow keys from its left end."""
    control.focus()
    page.keyboard.press("Home")
    for _ in range(STEPS):
        page.keyboard.press("ArrowRight")
        page.evaluate(TWO_FRAMES)


def in_pages(browser: Browser, wanted: list[str]) -> Iterator[tuple[str, str, float, float]]:
    """All controls of the pages."""
    for name in wanted:
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto((BUILT / f"{name}.html").as_uri())
        page.evaluate(DRAW_ALL)
        for told in responses(page, page.locator("article")):
            yield name, *told
        page.close()


def in_lab(browser: Browser, wanted: list[str]) -> Iterator[tuple[str, str, float, float]]:
    """All controls of the notebooks, each run in a JupyterLab."""
    with tempfile.TemporaryDirectory() as home, jupyterlab(ROOT / "notebooks", Path(home)) as lab:
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto(f"{lab}/lab?reset")
        page.wait_for_function(READY, timeout=60_000)
        for name in wanted:
            notebook = ROOT / f"{name}.ipynb"
            if not notebook.is_file() or "labkit.interactive" not in notebook.read_text("utf-8"):
                continue
            page.evaluate(OPEN, notebook.name)
            page.evaluate(RUN_ALL)
            for told in responses(page, page.locator(".jp-Notebook:visible")):
                yield name, *told
            page.evaluate(CLOSE)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument(
        "pages", nargs="*", metavar="PAGE", help="such as notebooks/04_icp_loop; default: all"
    )
    parser.add_argument(
        "--lab", action="store_true", help="move the sliders of the notebooks instead"
    )
    asked = parser.parse_args()
    wanted = asked.pages or names()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=QUIET)
        if not asked.lab:
            print(f"In seconds, {SLOWER} times slower:\n")
            print("| page | MB | largest paint | blocked | long tasks | the longest | number |")
            print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
            for name in wanted:
                *numbers, count = weigh(browser, name)
                told = " | ".join(f"{each:.2f}" for each in numbers)
                print(f"| {name} | {told} | {count:.0f} |", flush=True)
            print()
        print("| page | control | by mouse [ms] | by keys [ms] |")
        print("| --- | --- | ---: | ---: |")
        for name, control, mouse, keys in (in_lab if asked.lab else in_pages)(browser, wanted):
            print(f"| {name} | {control} | {mouse:.0f} | {keys:.0f} |", flush=True)
        browser.close()


if __name__ == "__main__":
    main()
