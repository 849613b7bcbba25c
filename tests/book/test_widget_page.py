"""What looks at the pages sees what it must complain of; a widget comes into a page at its size."""

from __future__ import annotations

import pytest

import labkit
from labkit.interactive import icp_sliders, live_figure
from tests.book.widget_page import opened, settle, written_page

FAULTS = {
    "a file from elsewhere": '<img src="https://elsewhere.invalid/picture.png">',
    "a file that is missing": '<img src="missing.png">',
    "an error on the console": "<script>console.error('told')</script>",
    "an exception": "<script>throw new Error('thrown')</script>",
}

# The height of a widget in the moment in which it comes into the page.
FIRST_HEIGHT = """document.addEventListener("DOMContentLoaded", () => {
    const note = () => {
        window.firstHeight ??= document.querySelector(".icp-explorer")?.offsetHeight;
    };
    new MutationObserver(note).observe(document.body, { childList: true, subtree: true });
})"""


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


@pytest.mark.parametrize("kind", ["sliders", "figure"])
def test_a_widget_has_its_height_from_the_first_moment(browser, tmp_path, kind):
    """What stands below moves once, when the widget comes, which is before one sees it."""
    scene = labkit.simulation.lesson_experiment()
    limits = {"xlim": (-8.0, 8.0), "ylim": (-8.0, 8.0), "start": (0, 0, 0)}
    values = {name: [-1.0, 0.0, 1.0] for name in ("turn [°]", "x [m]", "y [m]")}
    points = {"source": scene.source.points, "target": scene.target.points}
    widget = {
        "sliders": lambda: icp_sliders(scene.source, scene.target, scene.T_init, sliders={}),
        "figure": lambda: live_figure("turn", values, label="two scans", **limits, **points),
    }[kind]()
    page = browser.new_page()
    page.add_init_script(FIRST_HEIGHT)

    page.goto(written_page(widget, tmp_path))
    page.locator(".icp-explorer").wait_for()
    settle(page)

    assert page.evaluate("() => window.firstHeight") == page.locator(".icp-explorer").evaluate(
        "root => root.offsetHeight"
    )
    page.close()
