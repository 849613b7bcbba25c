"""What is written in a picture stands where it belongs: numbers of axes, the ring of a curve."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Page

from labkit.interactive import icp_explorer
from tests.book.widget_page import readout, settle

# Lists what is drawn: canvas, how a text is aligned or what else it is, text or size, and place.
RECORD = """() => {
    window.marks = [];
    const record = (name, kind, content) => {
        const draw = CanvasRenderingContext2D.prototype[name];
        CanvasRenderingContext2D.prototype[name] = function (...values) {
            const [text, u, v] = content(...values);
            const what = kind ?? this.textAlign.replace("start", "left");
            window.marks.push([this.canvas.className, what, text, u, v]);
            return draw.apply(this, values);
        };
    };
    record("fillText", null, (text, u, v) => [String(text), u, v]);
    record("arc", "circle", (u, v, radius) => [String(radius), u, v]);
    record("strokeRect", "square", (u, v, side) => [String(side), u + side / 2, v + side / 2]);
}"""
RING = "5.5"  # radius in px of the ring at the iteration that is shown
Mark = tuple[str, float, float]  # text or size, and where it stands [px]


@pytest.fixture
def page(show) -> Page:
    """An explorer that shows the third iteration of a run, and lists what it has drawn."""
    page = show(icp_explorer(), ".icp-readouts dd", reduced_motion="reduce")
    page.get_by_role("button", name="End").click()
    page.get_by_role("button", name="Start", exact=True).click()
    for _ in range(2):
        page.get_by_role("button", name="Step").click()
    settle(page)
    page.evaluate(RECORD)
    page.get_by_role("button", name="Step").click()
    settle(page)
    return page


def marks(page: Page, canvas: str, kind: str) -> list[Mark]:
    """What was drawn on a canvas, each mark once."""
    recorded = page.evaluate("() => window.marks")
    return sorted({tuple(mark[2:]) for mark in recorded if mark[:2] == [canvas, kind]})


def number(text: str) -> float:
    return float(text.replace("−", "-"))


def test_the_grid_counts_metres_from_the_older_scanner(page):
    ((_, u_origin, v_origin),) = marks(page, "icp-plane", "square")
    texts = marks(page, "icp-plane", "left")
    ((_, _, bottom),) = marks(page, "icp-plane", "right")  # "x [m]"
    x = [(number(text), u - 3 - u_origin) for text, u, v in texts if v == bottom]
    y = [
        (number(text), v_origin - v - 3) for text, _, v in texts if v != bottom and text != "y [m]"
    ]

    scale = x[-1][1] / x[-1][0]

    assert len(x) > 2
    assert len(y) > 2
    for metres, pixels in x + y:
        assert pixels == pytest.approx(metres * scale, abs=0.01)
    assert ("y [m]", 3, 3) in texts
    assert marks(page, "icp-plane", "right")[0][0] == "x [m]"


def test_the_ring_of_the_curve_stands_at_the_iteration_and_its_cost(page):
    ((_, u, v),) = [mark for mark in marks(page, "icp-cost", "circle") if mark[0] == RING]
    below, beside = marks(page, "icp-cost", "center"), marks(page, "icp-cost", "right")
    iterations = [(place, number(text)) for text, place, _ in below]
    logarithms = [(place - 4, np.log10(number(text))) for text, _, place in beside]

    shown = np.polyval(np.polyfit(*np.transpose(iterations), 1), u)
    cost = 10 ** np.polyval(np.polyfit(*np.transpose(logarithms), 1), v)

    assert readout(page, "shown").inner_text() == f"iteration {shown:.0f} of 28"
    told = number(readout(page, "cost J").inner_text().removesuffix(" m²"))
    assert cost == pytest.approx(told, rel=0.02)
