"""Drive in a page without a kernel: by keys, mouse and touch, and the link to race."""

from __future__ import annotations

import re
from itertools import cycle
from urllib.parse import parse_qs

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from labkit.interactive import drive
from tests.book.mouse import finger, middle
from tests.book.widget_page import copied_link, enter, repeat_until, run_until, settle

SCAN_PERIOD = 0.2  # [s]
# Whether a disc of a robot's size is filled there with the colour of the robot.
FILLED = """part => {
    const canvas = document.querySelector(".icp-stage canvas");
    const share = canvas.width / canvas.clientWidth;
    const [x, y, width, height] = part.map(each => Math.round(share * each));
    const { data } = canvas.getContext("2d").getImageData(x, y, width, height);
    const isBlue = k => data[k + 3] > 200 && data[k] < 60 && data[k + 2] > 130;
    const side = Math.floor(8 * share);
    const isRow = k => Array.from({ length: side }, (_, i) => k + 4 * i).every(isBlue);
    const isDisc = k => Array.from({ length: side }, (_, j) => k + 4 * j * width).every(isRow);
    for (let v = 0; v + side < height; v++)
        for (let u = 0; u + side < width; u++) if (isDisc(4 * (v * width + u))) return true;
    return false;
}"""


@pytest.fixture(params=[{"width": 1366, "height": 768}, {"width": 390, "height": 844}], ids=str)
def window(request) -> dict[str, object]:
    touch = request.param["width"] < 500
    return {"viewport": request.param, "has_touch": touch, "is_mobile": touch}


@pytest.fixture
def page(show, window) -> Page:
    return show(drive(), ".icp-score", "#drive-corridor", **window)


def score(page: Page) -> tuple[float, float, int]:
    """Metres driven, metres off, and the number of steps."""
    said = page.locator(".icp-score").inner_text()
    words = r"(\d+) m driven, (\d+\.\d\d) m off, \d+\sof\s(\d+)\swrong"
    metres, off, steps = re.fullmatch(words, said).groups()
    return float(metres), float(off), int(steps)


def copied_steps(page: Page) -> tuple[str, np.ndarray]:
    """The link to a drive, and its steps: rows of Δx, Δy [m] and a turn [rad]."""
    page.locator(".icp-advice").evaluate("node => (node.textContent = '')")
    link = copied_link(page, "Copy link", ".icp-advice")
    (numbers,) = parse_qs(link.partition("?")[2])["drive"]
    thousandths = [int(number, 36) for number in numbers.split(".")]
    return link, np.reshape(thousandths, (-1, 3)) / 1000.0


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


def blue_within(page: Page, box: dict, stage: dict) -> bool:
    """Whether the robot, the one large blue thing, is drawn in a part of the picture."""
    part = [box["x"] - stage["x"], box["y"] - stage["y"], box["width"], box["height"]]
    return page.evaluate(FILLED, part)


def test_in_a_corridor_only_wheels_tell_and_a_link_holds_the_drive(page):
    address = page.url.split("#")[0]
    drive_on(page, 4)
    metres, off, count = score(page)
    assert off == pytest.approx(metres, abs=0.6)  # the blue robot never left
    advice = page.locator(".icp-advice")
    expect(advice).to_contain_text(re.compile(r"Scan \d+: the robot drove 0\.\d\d m and turned 0°"))
    expect(advice).to_contain_text("does not see a shift along (1.00, ")
    link, steps = copied_steps(page)
    assert count == len(steps)
    seconds = f"{(count + 1) * SCAN_PERIOD:.0f} s"
    page.get_by_label("wheels").select_option("good")
    page.get_by_role("button", name="Start again").click()
    enter(page, link)
    expect(page.get_by_label("world")).to_have_value("Corridor")
    beaten = re.compile(rf"To beat, in orange: {metres:.0f} m in {seconds}, {off:.2f} m off")
    expect(advice).to_contain_text(beaten)  # by a replay: the link does not say it
    for nonsense in (
        "drive=%00.zz.-",
        "world=moon&drive=1",
        "world=Room&drive=rs.0.0",
        "world=Room&wheels=toString&drive=1",
    ):  # is ignored
        enter(page, f"{address}#drive?{nonsense}")
        expect(page.locator(".icp-advice")).to_contain_text(re.compile("^Drive"))
        expect(page.get_by_label("wheels")).to_have_value("none")


def test_a_link_sets_dials_to_what_a_slider_can(page):
    address = page.url.split("#")[0]

    enter(page, f"{address}#drive?world=Room&overlap_ratio=7&max_correspondence_distance=0.1")

    expect(page.get_by_label("overlap ρ")).to_have_attribute("aria-valuetext", "1.00")
    expect(page.get_by_label("gate")).to_have_attribute("aria-valuetext", "0.10 m")


def test_the_robot_comes_to_rest_where_the_focus_leaves_it_with_a_key_held(page):
    page.locator(".icp-stage canvas").focus()
    page.keyboard.down("ArrowUp")
    page.wait_for_function("() => parseInt(document.querySelector('.icp-score').textContent) >= 1")

    page.get_by_label("world").focus()

    # it is told where the robot rests, and while a key is held it does not
    expect(page.locator(".icp-drive > .icp-spoken")).to_have_text(re.compile("m driven"))
    page.keyboard.up("ArrowUp")


def test_world_and_wheels_are_there_after_a_reload(page):
    address = page.url.split("#")[0]
    page.get_by_label("world").select_option("Doorways")
    page.get_by_label("wheels").select_option("noisy")

    enter(page, address)

    expect(page.get_by_label("world")).to_have_value("Doorways")
    expect(page.get_by_label("wheels")).to_have_value("noisy")


def test_a_wall_that_stops_the_robot_is_said(show):
    page = show(drive(), ".icp-score", "#drive-room", by_hand=True)
    page.locator(".icp-stage canvas").focus()

    page.keyboard.down("ArrowUp")
    run_until(page, ".icp-advice", "A wall stops the robot")
    page.keyboard.up("ArrowUp")
    page.keyboard.down("ArrowDown")

    run_until(page, ".icp-advice", "Drive a few rounds")


def test_a_finger_is_told_of_no_key_and_sees_a_corridor_as_wide_as_a_thumb(show):
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    page = show(drive(), ".icp-score", "#drive-corridor", **phone)

    for world in page.get_by_label("world").locator("option").all_inner_texts():
        page.get_by_label("world").select_option(world)
        settle(page)
        assert "Shift" not in page.locator(".icp-drive").inner_text()

    assert page.locator(".icp-stage canvas").bounding_box()["height"] > 200


KEYS = {"ArrowUp": (1, 0), "w": (1, 0), "ArrowDown": (-1, 0), "s": (-1, 0)}  # ahead, left
KEYS |= {"ArrowLeft": (0, 1), "a": (0, 1), "ArrowRight": (0, -1), "d": (0, -1)}


def test_each_key_drives_its_own_way(show):
    page = show(drive(), ".icp-score", "#drive-corridor", by_hand=True)  # it looks along x
    for key, direction in KEYS.items():
        page.get_by_role("button", name="Start again").click()
        page.locator(".icp-stage canvas").focus()

        page.keyboard.down(key)
        page.clock.run_for(900)
        page.keyboard.up(key)

        x, _, turn = copied_steps(page)[1].sum(axis=0)
        assert (np.sign(x), np.sign(turn)) == direction, key


def test_with_shift_the_robot_drives_slowly(show):
    page = show(drive(), ".icp-score", "#drive-corridor", by_hand=True)

    def metres(*keys: str) -> float:
        page.get_by_role("button", name="Start again").click()
        page.locator(".icp-stage canvas").focus()
        for key in keys:
            page.keyboard.down(key)
        page.clock.run_for(8000)
        for key in keys:
            page.keyboard.up(key)
        return score(page)[0]

    slow = metres("Shift", "ArrowUp")
    fast = metres("ArrowUp")

    assert 0 < slow < 0.75 * fast


def test_the_prompt_lies_on_no_robot(page):
    for world in ("Room", "Corridor", "Doorways", "Two rooms"):
        page.get_by_label("world").select_option(world)
        settle(page)
        prompt, stage = (
            page.locator(each).bounding_box() for each in (".icp-prompt", ".icp-stage")
        )
        assert not blue_within(page, prompt, stage)


def test_a_hand_drives_and_places_are_recognised(show, window):
    page = show(drive(), ".icp-score", "#drive-corridor", by_hand=True, **window)
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

    def on() -> None:
        point("Move", *next(rounds))
        page.clock.run_for(700)

    repeat_until(lambda: score(page)[0] >= 8, on, "8 m driven")
    point("End", 0.1, -0.1)
    run_until(page, ".icp-drive > .icp-spoken", "m driven")  # at rest
    page.emulate_media(reduced_motion="reduce")  # it slides at once
    page.get_by_role("button", name="Recognise places").click()
    run_until(page, ".icp-advice", "recognise")
