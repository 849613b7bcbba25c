"""Drive in a page without a kernel: by keys, mouse and touch, and the link to race."""

from __future__ import annotations

import re
from itertools import cycle

import pytest
from mouse import finger, middle
from playwright.sync_api import Page, expect
from widget_page import copied_link, enter, settle

from labkit.interactive import drive


@pytest.fixture(params=[{"width": 1366, "height": 768}, {"width": 390, "height": 844}], ids=str)
def page(request, show) -> Page:
    touch = request.param["width"] < 500
    told = {"viewport": request.param, "has_touch": touch, "is_mobile": touch}
    return show(drive(), ".icp-score", "#drive-corridor", **told)


def score(page: Page) -> tuple[float, float]:
    said = page.locator(".icp-score").inner_text()
    metres, off = re.fullmatch(r"(\d+) m driven, (\d+\.\d\d) m off", said).groups()
    return float(metres), float(off)


def drive_on(page: Page, least: float) -> None:
    """Hold the key until the robot has driven so many metres, and come to rest."""
    page.locator(".icp-stage canvas").focus()
    page.keyboard.down("ArrowUp")
    until = f"() => parseInt(document.querySelector('.icp-score').textContent) >= {least}"
    page.wait_for_function(until)
    page.keyboard.up("ArrowUp")
    spoken = page.locator(".icp-drive > .icp-spoken")
    expect(spoken).to_have_text(re.compile("m driven"))
    settle(page)


def test_in_a_corridor_only_wheels_tell_and_a_link_holds_the_drive(page):
    address = page.url.split("#")[0]
    drive_on(page, 4)
    metres, off = score(page)
    assert off == pytest.approx(metres, abs=0.6)  # the blue robot never left
    expect(page.locator(".icp-advice")).to_contain_text("looks the same everywhere")
    link = copied_link(page, "Copy link", ".icp-advice")
    page.get_by_label("wheels").select_option("good")
    page.get_by_role("button", name="Start again").click()
    enter(page, link)
    expect(page.get_by_label("world")).to_have_value("Corridor")
    expect(page.locator(".icp-advice")).to_contain_text(f"To beat, in orange: {metres:.0f} m")
    for nonsense in ("drive=%00.zz.-", "world=moon&drive=1", "metres=x&drive=1.1.1"):  # is ignored
        enter(page, f"{address}#drive?{nonsense}")
        expect(page.locator(".icp-advice")).to_contain_text(re.compile("^Drive"))


def test_a_hand_drives_and_places_are_recognised(page):
    page.get_by_label("world").select_option("Room")
    canvas = page.locator(".icp-stage canvas")
    (x, y), width = middle(canvas), canvas.bounding_box()["width"]
    touch = finger(page)

    def point(kind: str, u: float, v: float) -> None:
        if width < 400:
            return touch(kind, x + u * width, y + v * width)
        page.mouse.move(x + u * width, y + v * width)
        return {"Start": page.mouse.down, "Move": list, "End": page.mouse.up}[kind]()

    point("Start", 0.1, -0.1)
    rounds = cycle([(-0.15, -0.1), (-0.2, 0.1), (0.1, 0.15), (0.1, -0.1)])
    while score(page)[0] < 8:
        point("Move", *next(rounds))
        page.wait_for_timeout(700)
    point("End", 0.1, -0.1)
    expect(page.locator(".icp-drive > .icp-spoken")).to_contain_text("m driven")  # at rest
    page.emulate_media(reduced_motion="reduce")  # it slides at once
    page.get_by_role("button", name="Recognise places").click()
    expect(page.locator(".icp-advice")).to_contain_text("recognise")
