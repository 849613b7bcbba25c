"""The explorer in a page without a kernel: by mouse, by keyboard, on a telephone."""

from __future__ import annotations

import re
from urllib.parse import unquote

import numpy as np
import pytest
from playwright.sync_api import Page, expect

import labkit
from labkit.interactive import Explorer, icp_explorer
from tests.book.mouse import Point, drag, finger, middle
from tests.book.test_labels_page import RECORD
from tests.book.widget_page import (
    FRAME,
    come_back,
    copied_link,
    drawn,
    enter,
    film,
    picture,
    promised,
    readout,
    repeat_until,
    run_until,
    settle,
)

AXES = "x", "y", "turn"
SIGN = ".icp-readouts dd"  # of an explorer that is drawn
AT_REST = """() => {
    const y = scrollY;
    return new Promise(told => setTimeout(() => told(scrollY === y), 300));
}"""

# How often what is read aloud changes.
LISTEN = """() => {
    window.heard = 0;
    for (const node of document.querySelectorAll("output, [role=status], [aria-live]"))
        new MutationObserver(() => window.heard++)
            .observe(node, { childList: true, characterData: true, subtree: true });
}"""

# A page for which 5 ms pass whenever it looks at its clock.
SLOW = """() => {
    let now = performance.now();
    performance.now = () => (now += 5);
}"""
# Puts a word in the place of a number.
DAMAGE_BET = """() => {
    const stored = JSON.parse(localStorage["labkit-explorer"]);
    for (const [key, place] of Object.entries(stored))
        if (key.startsWith("bet on")) stored[key] = [place[0], "far"];
    localStorage["labkit-explorer"] = JSON.stringify(stored);
}"""
SIZE = {"width": 800, "height": 1400}
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
KNOB, ARM = "7", 50.0  # the knob's radius, and how far it lies from the scanner [px]
MOVES = {
    "ArrowLeft": [-1, 0, 0],
    "ArrowRight": [1, 0, 0],
    "ArrowDown": [0, -1, 0],
    "ArrowUp": [0, 1, 0],
    "PageUp": [0, 0, 1],
    "PageDown": [0, 0, -1],
}
REST = 1000  # ms of a page's clock, after which all is told


@pytest.fixture(scope="module")
def explorer() -> Explorer:
    return icp_explorer()


@pytest.fixture
def page(show, explorer: Explorer) -> Page:
    return show(explorer, SIGN, viewport=SIZE, reduced_motion="reduce")


def guess(page: Page) -> list[float]:
    """X [m], y [m] and turn [°], as the sliders tell them."""
    settle(page)
    told = [page.get_by_label(f"guess {each}").get_attribute("aria-valuetext") for each in AXES]
    return [float(each.strip(" m°").replace("−", "-")) for each in told]


def free_spot(page: Page) -> Point:
    """A place on the map that is not the knob."""
    x, y = middle(page.locator(".icp-plane"))
    return x + 70.0, y - 50.0


def slide(page: Page, slider: str, metres: float) -> None:
    """Set a slider of the guess to the step nearest to a value; its steps are 5 cm."""
    page.get_by_label(slider).fill(str(round((metres + 3.0) / 0.05)))
    settle(page)


def choose(page: Page, scene: str) -> None:
    page.get_by_label("scans", exact=True).select_option(scene)
    settle(page)


def press(page: Page, *names: str) -> None:
    for name in names:
        page.get_by_role("button", name=name, exact=True).click()


def test_it_says_what_labkit_says(page, explorer):
    """Every scene, from its own guess."""
    for name, scene in explorer.scenes.items():
        choose(page, name)
        run = labkit.icp(scene.source, scene.target, scene.T_init)
        count, points = run.history[0].inlier_count, len(scene.source)
        expect(page.locator(".icp-sentence")).to_contain_text(f"keep {count} of {points} pairs")
        press(page, "End")
        rmse = f"{run.inlier_rmse:.4f} m over {run.inlier_count} inliers"
        expect(readout(page, "RMSE")).to_have_text(rmse)
        ending = f"{run.iterations} iterations, {run.message}"
        expect(readout(page, "the run")).to_contain_text(ending)


@pytest.mark.parametrize("delta", [0.02, 0.2])
def test_the_sentence_counts_the_pairs_that_delta_weighs_down(show, explorer, delta):
    scene = next(iter(explorer.scenes.values()))
    parameters = labkit.IcpParameters(huber_delta=delta)
    run = labkit.icp(scene.source, scene.target, scene.T_init, parameters)
    pairs = run.history[0].correspondences
    count = (pairs.kept & (pairs.weights < 1.0)).sum()

    page = show(icp_explorer([scene], parameters), SIGN, reduced_motion="reduce")

    told = f"weighs {count} of them down." if count else "weighs none down."
    expect(page.locator(".icp-sentence")).to_contain_text(told)


def test_the_legend_counts_the_points_that_a_coarse_iteration_passes_over(show, explorer):
    scene = explorer.scenes["The lesson's experiment"]
    parameters = labkit.IcpParameters(approach=True)
    run = labkit.icp(scene.source, scene.target, scene.T_init, parameters)
    count = len(scene.source) - len(run.history[0].correspondences.kept)

    page = show(icp_explorer([scene], parameters), SIGN, reduced_motion="reduce")

    assert count > 0
    expect(page.locator(".icp-legend")).to_contain_text(f"not looked at: {count}")


def test_a_damaged_bet_in_the_browser_s_storage_is_no_bet(page):
    press(page, "Bet")
    page.keyboard.press("ArrowRight")
    page.wait_for_function("() => JSON.stringify({ ...localStorage }).includes('bet on')")

    page.evaluate(DAMAGE_BET)
    page.reload()
    press(page, "End")

    expect(readout(page, "the run")).to_contain_text("iterations")
    expect(readout(page, "your bet")).to_have_count(0)


def test_a_basin_is_no_longer_that_of_other_parameters(show, explorer):
    page = show(explorer, SIGN, viewport=SIZE, reduced_motion="reduce")
    status = page.locator(".icp-basin .icp-status")
    press(page, "Compute the basin")
    expect(status).to_contain_text("guesses end within")
    expect(page.locator(".icp-left > .icp-status")).to_contain_text("A run from this guess")

    page.get_by_label("overlap ρ").press("ArrowLeft")

    expect(status).to_have_text("Parameters, heading or scene have changed since.")


def test_a_run_tells_its_end_only_once_it_was_played(page):
    """Or the bet on it would be none; the answer, the error and the rest of the curve wait."""
    legend, curve = page.locator(".icp-legend"), page.locator(".icp-cost")
    for told in (0, 1):
        expect(readout(page, "error")).to_have_count(told)
        expect(readout(page, "the run")).to_have_text(re.compile("28 iterations" if told else "^$"))
        assert ("reference" in legend.inner_text()) == bool(told)
        expect(curve).to_have_attribute("aria-label", re.compile(f"over {28 * told} iterations"))
        press(page, "Bet")
        page.keyboard.press("ArrowRight")
        expect(readout(page, "your bet")).to_have_count(0)
        press(page, "End")
        expect(readout(page, "your bet")).to_have_text(re.compile(r"0\.4\d m from the end"))
        press(page, "Start")
    come_back(page, kept="bet")
    press(page, "End")
    expect(readout(page, "your bet")).to_have_count(1)
    press(page, "Reset", "End")
    expect(readout(page, "your bet")).to_have_count(0)


def test_a_run_that_fails_at_once_says_so(page):
    for slider in ("gate", "guess x", "guess y"):
        page.get_by_label(slider).press("Home")

    expect(readout(page, "the run")).to_contain_text("failed: fewer than 3 correspondences")
    expect(readout(page, "shown")).to_contain_text("0 of 0")
    expect(page.get_by_role("button", name="End")).to_be_disabled()


def test_the_scan_is_dragged_turned_and_slid(page):
    plane = page.locator(".icp-plane")
    x, y, turn = guess(page)
    drag(page, free_spot(page), (40.0, -30.0))
    moved = guess(page)
    assert moved[0] > x + 0.2
    assert moved[1] > y + 0.2
    assert moved[2] == turn
    plane.focus()
    page.keyboard.press("PageDown")
    page.get_by_label("guess turn").press("ArrowRight")
    assert guess(page)[2] == turn
    press(page, "Reset")
    assert guess(page) == pytest.approx([x, y, turn])
    for by in ((3000.0, -2000.0), (-3000.0, 2000.0)):  # off the map it stays within reach
        drag(page, free_spot(page), by)
        x, y, _ = guess(page)
        assert -6.0 < x < 14.0
        assert -8.0 < y < 8.0


def test_the_knob_turns_the_scan_with_the_hand(page):
    page.evaluate(RECORD)
    page.locator(".icp-plane").press("ArrowUp")
    before = np.radians(guess(page)[2])
    box = page.locator(".icp-plane").bounding_box()
    u, v = [mark[3:] for mark in page.evaluate("() => window.marks") if mark[2] == KNOB][-1]

    drag(page, (box["x"] + u, box["y"] + v), (0.0, -25.0))

    turned = np.arctan2(ARM * np.sin(before) + 25.0, ARM * np.cos(before))
    assert guess(page)[2] == pytest.approx(np.degrees(turned), abs=2.0)


@pytest.mark.parametrize(("shift", "metres", "degrees"), [("", 0.05, 1.0), ("Shift+", 0.01, 0.2)])
def test_each_key_moves_the_scan_its_own_way(page, shift, metres, degrees):
    for key, direction in MOVES.items():
        before = np.array(guess(page))

        page.locator(".icp-plane").press(shift + key)

        moved = (guess(page) - before) / [metres, metres, degrees]
        assert moved == pytest.approx(direction, abs=0.55), key  # a turn is told to 0.1°


def test_steps_play_and_pause_and_are_told_in_one_sentence(show, explorer):
    page = show(explorer, SIGN, viewport=SIZE, by_hand=True)
    shown, spoken = readout(page, "shown"), page.locator(".icp-spoken")
    page.clock.run_for(REST)
    expect(shown).to_have_text("the guess, iteration 0 of 28")
    expect(spoken).to_contain_text("keep 143 of 180 pairs")
    expect(page.get_by_role("button", name="Start")).to_be_disabled()
    press(page, "Step")
    page.clock.run_for(REST)
    expect(shown).to_have_text("iteration 1 of 28")
    page.evaluate(LISTEN)
    press(page, "Play")
    page.clock.run_for(REST)
    expect(shown).not_to_have_text("iteration 1 of 28")
    press(page, "Pause")
    page.clock.run_for(FRAME)
    paused = shown.inner_text()
    page.clock.run_for(REST)
    expect(shown).to_have_text(paused)
    assert page.evaluate("() => window.heard") <= 3  # not one by one what is drawn
    page.emulate_media(reduced_motion="reduce")
    press(page, "Play")
    page.clock.run_for(REST)
    expect(shown).to_have_text("iteration 28 of 28")
    expect(page.get_by_role("button", name="Step")).to_be_disabled()
    expect(spoken).to_contain_text("28 iterations, converged")


def test_the_wheel_zooms_about_the_cursor_within_bounds(page):
    nearer, farther = page.get_by_title("Zoom in"), page.get_by_title("Zoom out")
    first = picture(page)
    expect(farther).to_be_disabled()
    page.mouse.move(*free_spot(page))
    page.mouse.wheel(0.0, -400.0)
    assert picture(page) == first  # a page that is scrolled is no map that is zoomed
    page.locator(".icp-plane").focus()
    for _ in range(8):
        page.mouse.wheel(0.0, -400.0)
        settle(page)
    expect(nearer).to_be_disabled()
    press(page, "Pan")
    shown, at = picture(page), guess(page)
    drag(page, free_spot(page), (30.0, 0.0))
    assert guess(page) == at
    assert picture(page) != shown


def test_a_copied_state_is_a_link_to_it(page):
    choose(page, "Room")
    page.get_by_label("gate").press("Home")
    page.locator(".icp-plane").press("ArrowUp")
    press(page, "Step")
    expect(readout(page, "shown")).to_contain_text("iteration 1 of")
    address, before = page.url, picture(page)
    copied = copied_link(page, "Copy state", ".icp-status")
    assert copied.startswith(f"{address}#icp?")
    for link, shown in ((copied, "iteration 1 of"), (address, "the guess, iteration 0 of")):
        enter(page, link)  # without the link, too: it is kept, but for the iteration
        expect(readout(page, "shown")).to_contain_text(shown)
        expect(page.get_by_label("gate")).to_have_attribute("aria-valuetext", "0.05 m")
        expect(page.get_by_label("scans", exact=True)).to_have_value("Room")
        assert guess(page) == [0.0, 0.05, 0.0]
        assert (picture(page) == before) == (link == copied)
    for nonsense in (
        "nonsense",
        unquote(copied.partition("=")[2]).replace('"shown":1', '"shown":-1'),
    ):
        enter(page, f"{address}#icp?state={nonsense}")  # is ignored
        expect(readout(page, "shown")).to_contain_text("the guess, iteration 0 of")


def test_the_basin_is_labkit_s_and_the_page_listens_meanwhile(show, explorer):
    """A start that the map counts as found is found by labkit, and the reverse."""
    page = show(explorer, SIGN, viewport=SIZE, by_hand=True)
    page.evaluate(SLOW)
    page.get_by_label("scans", exact=True).select_option("Two rooms")
    page.clock.run_for(FRAME)
    without, status = drawn(page), page.locator(".icp-basin .icp-status")
    press(page, "Compute the basin", "Stop", "Compute again")
    run_until(page, ".icp-basin .icp-status", "guesses end within 0.1 m of the truth")
    walk = film(page, duration=REST)
    assert without not in walk
    assert len(set(walk)) > 5
    scene = explorer.scenes["Two rooms"]
    target, found = labkit.Target(scene.target), np.zeros((15, 15), bool)
    x, y, _ = labkit.to_xytheta(scene.T_reference)
    for column, row in np.ndindex(15, 15):
        dx, dy = (column - 7) / 7.0, (row - 7) / 7.0
        run = labkit.icp(scene.source, target, labkit.transform(x + dx, y + dy, 0.0))
        error = labkit.to_xytheta(
            labkit.compose(labkit.invert(scene.T_reference), run.T_target_source)
        )
        found[column, row] = np.hypot(*error[:2]) <= 0.10 and abs(error[2]) <= np.radians(2.0)
    page.clock.resume()
    expect(status).to_contain_text(f"{found.sum()} of 225 guesses")
    column, row = np.argwhere(found & ~found.T)[0]  # columns lie along x
    slide(page, "guess x", x + (column - 7) / 7.0)
    slide(page, "guess y", y + (row - 7) / 7.0)
    expect(page.locator(".icp-left > .icp-status")).to_contain_text("from this guess finds")
    page.get_by_label("overlap ρ").press("ArrowLeft")
    expect(status).to_contain_text("have changed since")
    page.get_by_label("overlap ρ").press("ArrowRight")
    expect(status).to_contain_text(f"{found.sum()} of 225 guesses")
    page.get_by_label("up to").select_option("2")
    expect(page.get_by_role("button", name="Compute the basin")).to_be_visible()


def test_it_fits_a_laptop_s_screen_at_one_height_and_prints_what_it_shows(page, explorer):
    page.set_viewport_size({"width": 1366, "height": 768})
    heights = set()
    for name in explorer.scenes:
        choose(page, name)
        heights.add(page.locator(".icp-explorer").bounding_box()["height"])
        press(page, "End")
        heights.add(page.locator(".icp-explorer").bounding_box()["height"])
    assert max(heights) <= 720.0
    assert max(heights) - min(heights) < 1.0
    page.emulate_media(media="print")
    expect(page.locator(".icp-plane")).to_be_visible()
    controls = page.locator(".icp-explorer").locator("button, input, .icp-basin")
    expect(controls.filter(visible=True)).to_have_count(0)


def test_on_a_telephone_a_finger_scrolls_but_for_one_on_the_scan(show, explorer):
    page = show(explorer, SIGN, **PHONE)
    at, touch = guess(page), finger(page)

    def swipe(right: float, down: float) -> float:
        """From a place of the map, in shares of its size, up; returns how far the page scrolls."""
        page.evaluate("() => scrollTo(0, 0)")
        box = page.locator(".icp-plane").bounding_box()
        x, y = box["x"] + right * box["width"], box["y"] + down * box["height"]
        touch("Start", x, y)
        for k in range(1, 8):
            touch("Move", x, y - 20.0 * k)
        touch("End", x, y)
        repeat_until(lambda: promised(page, AT_REST), lambda: None, "the swipe to run out")
        return page.evaluate("() => scrollY")

    assert swipe(0.55, 0.93) > 30  # no point is near
    assert guess(page) == at
    assert swipe(0.06, 0.47) < 5  # the scanner
    assert guess(page) != at


def test_two_fingers_zoom_in_as_they_part_and_out_as_they_meet(show, explorer):
    page = show(explorer, SIGN, **PHONE)
    (x, y), touch = middle(page.locator(".icp-plane")), finger(page)
    farther = page.get_by_title("Zoom out")

    for start, end in ((20.0, 80.0), (80.0, 20.0)):
        expect(farther).to_be_disabled() if start < end else expect(farther).to_be_enabled()
        for kind, apart in (("Start", start), ("Move", end), ("End", end)):
            touch(kind, x - apart, y, x + apart, y)
        settle(page)

    expect(farther).to_be_disabled()
