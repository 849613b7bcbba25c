"""The explorer in a page without a kernel: by mouse, by keyboard, in the dark, on a telephone.

The page holds what a page of the book does: require.js, the widgets' files and the state.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from statistics import median

import numpy as np
import pytest
from mouse import Point, drag, middle, thumb
from playwright.sync_api import Browser, Locator, Page, expect

pytest.importorskip("anywidget")

from widget_page import written_page

import labkit
from labkit.interactive import Explorer, default_scenes, icp_explorer

DELAY = 100.0  # ms from an event to the numbers that it changes, in the median
FIT = "() => document.documentElement.scrollWidth <= window.innerWidth"
TWO_FRAMES = "() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"

# Notes for each input event how long the readouts took to follow.
STOPWATCH = """() => {
    window.delays = [];
    let since = null;
    addEventListener("input", () => { since ??= performance.now(); }, true);
    new MutationObserver(() => {
        if (since === null) return;
        window.delays.push(performance.now() - since);
        since = null;
    }).observe(document.querySelector(".icp-readouts"), { childList: true });
}"""
# Counts how often the basin gives way to the page.
SLICES = """() => {
    window.slices = 0;
    const later = window.setTimeout;
    window.setTimeout = (work, ...rest) => {
        if (rest.length === 0) window.slices++;
        return later(work, ...rest);
    };
}"""
# A slider that moves without taking the focus, as when Python moves it.
MOVED = "node => { node.value = 40; node.dispatchEvent(new Event('input')); }"
NAMELESS = """root => [...root.querySelectorAll("input, select, button, canvas, [role]")]
    .filter(node => !(node.labels?.length || node.textContent.trim() || node.ariaLabel
        || node.getAttribute("role") === "status"))
    .map(node => node.outerHTML)"""


@pytest.fixture(scope="module")
def explorer() -> Explorer:
    pytest.importorskip("rtbdata")
    return icp_explorer()


@pytest.fixture(scope="module")
def address(explorer: Explorer, tmp_path_factory: pytest.TempPathFactory) -> str:
    return written_page(explorer, tmp_path_factory.mktemp("page"))


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    """The page, read; on leaving, nothing has been asked of the network, and nothing failed."""
    page = browser.new_page(viewport={"width": 800, "height": 1400})
    asked: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda r: asked.append(r.url) if r.url.startswith("http") else None)
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: complaints.append(str(e)))
    page.goto(address)
    page.locator(".icp-readouts dd").first.wait_for()
    yield page
    page.close()
    assert asked == []
    assert complaints == []


def readout(page: Page, name: str) -> Locator:
    return page.locator(f"[data-readout='{name}']")


def picture(page: Page) -> str:
    """The map as it is drawn, once all that has happened shows in it."""
    page.evaluate(TWO_FRAMES)
    drawn: str = page.locator(".icp-plane").evaluate("canvas => canvas.toDataURL()")
    return drawn


def guess(page: Page) -> list[float]:
    page.evaluate(TWO_FRAMES)
    fields = page.locator(".icp-number input").all()
    return [float(field.input_value()) for field in fields]


def free_spot(page: Page) -> Point:
    """A place on the map that is not the knob."""
    x, y = middle(page.locator(".icp-plane"))
    return x + 70.0, y - 50.0


def test_it_says_what_labkit_says(page, explorer):
    """Every scene, from its own guess, under both metrics."""
    for metric in ("point_to_point", "point_to_line"):
        page.get_by_label("metric").select_option(metric)
        for name, scene in explorer.scenes.items():
            page.get_by_label("scans", exact=True).select_option(name)
            told = labkit.IcpParameters(metric=metric)
            run = labkit.icp(scene.source, scene.target, scene.T_init, told)
            expect(readout(page, "shown")).to_have_text(
                f"the guess, iteration 0 of {run.iterations}"
            )
            count, points = run.history[0].inlier_count, len(scene.source)
            expect(readout(page, "inliers")).to_contain_text(f"{count} of {points} ")
            page.get_by_role("button", name="End").click()
            rmse = f"{run.inlier_rmse:.4f} m over {run.inlier_count} inliers"
            expect(readout(page, "RMSE")).to_have_text(rmse)
            ending = f"{run.iterations} iterations, {run.message}; ends"
            expect(readout(page, "the run")).to_contain_text(ending)
            shown = f"the result, iteration {run.iterations} of {run.iterations}"
            expect(readout(page, "shown")).to_have_text(shown)
            x, y, theta = labkit.to_xytheta(run.T_target_source)
            said = readout(page, "pose").inner_text()
            assert re.fullmatch(r"\(-?\d\.\d{3}, -?\d\.\d{3}\) m, -?\d+\.\d\d°", said)
            *shift, turn = map(float, re.findall(r"[-\d.]+", said))
            # To the last digit: of points that are equally near, as some are in a recorded
            # scan, rounding alone decides which is taken.
            assert shift == pytest.approx([x, y], abs=1e-3)
            assert turn == pytest.approx(np.degrees(theta), abs=1e-2)


def test_it_says_how_many_points_are_not_looked_at_from_afar(page, explorer):
    name, scene = next((n, s) for n, s in explorer.scenes.items() if len(s.source.points) >= 480)
    page.get_by_label("scans", exact=True).select_option(name)
    legend = page.locator(".icp-legend")
    expect(legend).not_to_contain_text("not looked at")
    page.get_by_label("begin wide, end narrow").check()
    points = len(scene.source.points)
    looked = len(range(0, points, points // 120))
    expect(readout(page, "inliers")).to_contain_text(f"of {looked} ")
    expect(legend).to_contain_text(f"not looked at: {points - looked}")


@pytest.mark.parametrize("name", ["gate", "overlap ρ", "Huber δ"])
def test_a_slider_dragged_by_the_mouse_is_followed_at_once(page, name):
    slider, readouts = page.get_by_label(name), page.locator(".icp-readouts")
    before, numbers = picture(page), readouts.inner_text()
    page.evaluate(STOPWATCH)
    drag(page, thumb(slider), (-60.0, 0.0), steps=20)
    page.evaluate(TWO_FRAMES)
    delays = page.evaluate("() => window.delays")
    print(f"{name}: {median(delays):.1f} ms in the median of {len(delays)}")
    assert len(delays) >= 5
    assert median(delays) < DELAY
    assert picture(page) != before
    assert readouts.inner_text() != numbers


@pytest.mark.parametrize("name", ["gate", "overlap ρ", "Huber δ", "iteration"])
def test_a_slider_obeys_the_keyboard_and_speaks(page, name):
    page.get_by_role("button", name="End").click()
    slider = page.get_by_label(name, exact=True)
    before = picture(page)  # which waits until the slider, too, is at the end
    value, said = slider.input_value(), slider.get_attribute("aria-valuetext")
    slider.focus()
    for _ in range(12):
        page.keyboard.press("ArrowLeft")
    assert int(slider.input_value()) == max(0, int(value) - 12)
    expect(slider).not_to_have_attribute("aria-valuetext", said)
    assert slider.evaluate("node => getComputedStyle(node).outlineStyle") == "solid"
    assert picture(page) != before
    page.keyboard.press("End")
    last = "off" if name in ("gate", "Huber δ") else re.compile(r"1\.00|(\d+) of \1")
    expect(slider).to_have_attribute("aria-valuetext", last)


def test_the_scan_is_dragged_and_turned(page):
    plane = page.locator(".icp-plane")
    x, y, turn = guess(page)
    drag(page, free_spot(page), (40.0, -30.0))
    moved = guess(page)
    assert moved[0] > x + 0.2
    assert moved[1] > y + 0.2
    assert moved[2] == turn
    expect(readout(page, "shown")).to_contain_text("the guess")
    plane.focus()
    for key in ("ArrowLeft", "ArrowUp", "PageDown"):
        page.keyboard.press(key)
    pressed = np.array(guess(page)) - moved
    assert pressed == pytest.approx([-0.05, 0.05, -1.0], abs=2e-3)
    page.get_by_role("button", name="Reset").click()
    assert guess(page) == pytest.approx([x, y, turn])


def test_the_guess_is_typed(page):
    field = page.get_by_label("turn [°]")
    field.fill("40")
    field.press("Enter")
    expect(readout(page, "shown")).to_contain_text("the guess")
    expect(readout(page, "pose")).to_contain_text("40.00°")


@pytest.mark.parametrize("key", ["Enter", "Tab"])
def test_a_typed_guess_shows_the_value_that_is_used(page, key):
    field = page.get_by_label("turn [°]")
    field.fill("400")
    field.press(key)
    expect(field).to_have_value("40.00")
    field.press("Tab")
    expect(field).to_have_value("40.00")


def test_a_guess_half_typed_is_left_alone_until_it_is_entered(page):
    field = page.get_by_label("turn [°]")
    field.fill("1")
    page.get_by_label("overlap ρ").evaluate(MOVED)
    page.evaluate(TWO_FRAMES)
    expect(field).to_have_value("1")


def test_an_emptied_guess_shows_its_value_again(page):
    field = page.get_by_label("turn [°]")
    field.fill("12")
    field.press("Enter")
    picture(page)
    field.fill("")
    field.press("Tab")
    expect(field).to_have_value("12.00")
    expect(readout(page, "pose")).to_contain_text("12.00°")


def test_steps_play_and_reset(page):
    shown, start = readout(page, "shown"), page.get_by_role("button", name="Start")
    expect(shown).to_have_text("the guess, iteration 0 of 28")
    expect(start).to_be_disabled()
    page.get_by_role("button", name="Step").click()
    expect(shown).to_have_text("on the way, iteration 1 of 28")
    page.get_by_role("button", name="Play").click()
    expect(shown).not_to_contain_text("iteration 1 of 28")
    page.get_by_role("button", name="Pause").click()
    expect(shown).to_contain_text("on the way")
    paused = shown.inner_text()
    page.wait_for_timeout(800)
    expect(shown).to_have_text(paused)
    page.emulate_media(reduced_motion="reduce")
    page.get_by_role("button", name="Play").click()
    expect(shown).to_have_text("the result, iteration 28 of 28")
    expect(page.get_by_role("button", name="Step")).to_be_disabled()
    start.click()
    expect(shown).to_contain_text("the guess")


def test_reset_brings_back_guess_parameters_view_and_start(page):
    first, field = picture(page), page.get_by_label("turn [°]")
    field.fill("5")
    field.press("Enter")
    page.get_by_label("gate").press("Home")
    page.get_by_role("button", name="Bet").click()
    page.get_by_role("button", name="End").click()
    for name in ("Zoom in", "Zoom in", "Pan"):
        page.get_by_title(name).or_(page.get_by_role("button", name=name)).first.click()
    assert picture(page) != first
    page.get_by_role("button", name="Reset").click()
    page.mouse.move(0.0, 0.0)
    assert picture(page) == first
    expect(readout(page, "shown")).to_have_text("the guess, iteration 0 of 28")


def test_zoom_has_bounds_and_a_zoomed_scan_still_moves(page):
    nearer, farther = page.get_by_title("Zoom in"), page.get_by_title("Zoom out")
    expect(farther).to_be_disabled()
    for _ in range(5):
        nearer.click()
    expect(nearer).to_be_disabled()
    x, _, _ = guess(page)
    drag(page, free_spot(page), (30.0, 0.0))
    closely = guess(page)[0] - x
    assert 0.01 < closely < 0.2
    page.get_by_role("button", name="Pan").click()
    before, at = picture(page), guess(page)
    drag(page, free_spot(page), (30.0, 0.0))
    assert guess(page) == at
    assert picture(page) != before
    for _ in range(5):
        farther.click()
    expect(farther).to_be_disabled()


def test_a_scan_dragged_off_the_map_stays_within_reach(page):
    box = page.locator(".icp-plane").bounding_box()
    assert box is not None
    for by in ((3000.0, -2000.0), (-3000.0, 2000.0)):
        drag(page, free_spot(page), by)
        x, y, _ = guess(page)
        assert -6.0 < x < 14.0
        assert -8.0 < y < 6.0


def test_a_bet_is_measured_when_the_run_has_ended(page):
    page.get_by_role("button", name="Bet").click()
    page.keyboard.press("ArrowRight")
    expect(readout(page, "your bet")).to_have_count(0)
    page.get_by_role("button", name="End").click()
    expect(readout(page, "your bet")).to_have_text("0.47 m from the end")  # of 0.52 m in x
    page.get_by_role("button", name="Start").click()
    expect(readout(page, "your bet")).to_have_count(0)
    page.reload()  # the bet is kept
    page.get_by_role("button", name="End").click()
    expect(readout(page, "your bet")).to_have_text("0.47 m from the end")
    page.get_by_role("button", name="Reset").click()
    page.get_by_role("button", name="End").click()
    expect(readout(page, "your bet")).to_have_count(0)


def test_a_copied_state_is_a_link_to_it(page, address):
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_label("scans", exact=True).select_option("Room")
    page.get_by_label("gate").press("Home")
    page.locator(".icp-plane").press("ArrowUp")
    page.get_by_role("button", name="Step").click()
    before, link = picture(page), address + "#icp?"
    page.get_by_role("button", name="Copy state").click()
    expect(page.locator(".icp-status").first).to_contain_text("clipboard")
    copied = page.evaluate("() => navigator.clipboard.readText()")
    assert copied.startswith(link)
    page.goto("about:blank")
    page.goto(copied)
    expect(readout(page, "shown")).to_contain_text("iteration 1 of")
    expect(page.get_by_label("gate")).to_have_attribute("aria-valuetext", "0.05 m")
    assert guess(page) == [0.0, 0.05, 0.0]
    assert picture(page) == before


@pytest.mark.parametrize("state", ["nonsense", '{"scene":"Room"}', '{"scene":"moon"}', "null"])
def test_a_link_that_makes_no_sense_is_ignored(page, address, state):
    page.goto("about:blank")
    page.goto(f"{address}#icp?state={state}")
    expect(readout(page, "shown")).to_have_text("the guess, iteration 0 of 28")


def test_reset_in_a_view_opened_later_goes_back_to_the_first_parameters(browser, tmp_path):
    """A second view finds the model as the first one left it."""
    explorer = icp_explorer(default_scenes()[:1], labkit.IcpParameters(huber_delta=0.1))
    explorer.huber_delta, explorer.metric = 0.05, "point_to_line"
    page = browser.new_page()
    page.goto(written_page(explorer, tmp_path))
    delta = page.get_by_label("Huber δ")
    expect(delta).to_have_attribute("aria-valuetext", "0.05 m")
    page.get_by_role("button", name="Reset").click()
    expect(delta).to_have_attribute("aria-valuetext", "0.10 m")
    expect(page.get_by_label("metric")).to_have_value("point_to_point")
    page.close()


def test_a_task_ticks_itself_off_when_all_it_asks_for_was_seen(page):
    said, end = (
        page.locator("summary", has_text="Things to try"),
        page.get_by_role("button", name="End"),
    )
    done = page.locator(".icp-tasks > .icp-done")
    expect(said).to_have_text("Things to try: 0 of 6 done")
    page.get_by_label("scans", exact=True).select_option("Room")
    end.click()
    expect(said).to_have_text("Things to try: 0 of 6 done")  # the gate that fails comes first
    page.get_by_label("gate").press("Home")
    picture(page)
    page.get_by_label("gate").press("End")
    expect(done).to_have_text(["Room: a gate of 0.05 m that fails, then a wider one that works"])
    page.get_by_label("scans", exact=True).select_option("Turn on the spot")
    for _ in range(3):
        page.get_by_role("button", name="Step").click()
    expect(said).to_have_text("Things to try: 2 of 6 done")
    page.get_by_label("scans", exact=True).select_option("The lesson's experiment")
    picture(page)  # the new scene's guess is in the field before another is typed over it
    page.get_by_label("x [m]").fill("2.5")
    page.get_by_label("x [m]").press("Enter")
    end.click()
    expect(said).to_have_text("Things to try: 3 of 6 done")


def open_basin(page: Page) -> None:
    page.locator("summary", has_text="Basin of convergence").click()


def test_the_page_listens_while_it_computes_the_basin(page):
    open_basin(page)
    page.get_by_role("button", name="Compute the basin").click()
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_role("button", name="Compute again")).to_be_visible()
    expect(page.locator(".icp-more .icp-status")).not_to_contain_text("of 225")


@pytest.mark.parametrize(
    ("control", "option"), [("offsets up to", "2"), ("scans", "The lesson's experiment")]
)
def test_a_basin_that_is_forgotten_is_computed_no_further(page, control, option):
    page.get_by_label("scans", exact=True).select_option("Two rooms")
    open_basin(page)
    page.evaluate(SLICES)
    page.get_by_role("button", name="Compute the basin").click()
    page.wait_for_function("() => window.slices > 2")
    page.get_by_label(control, exact=True).select_option(option)
    page.evaluate(TWO_FRAMES)
    page.wait_for_timeout(100)  # what has begun may end
    before = page.evaluate("() => window.slices")
    page.wait_for_timeout(300)
    assert page.evaluate("() => window.slices") == before
    expect(page.get_by_role("button", name="Compute the basin")).to_be_visible()


def test_the_basin_is_labkit_s(page, explorer):
    """A start that the picture counts as found is found by labkit, and the reverse."""
    page.get_by_label("scans", exact=True).select_option("Two rooms")
    open_basin(page)
    page.get_by_role("button", name="Compute the basin").click()
    status = page.locator(".icp-more .icp-status")
    expect(status).to_contain_text("guesses end within 0.1 m of the truth", timeout=30000)
    scene = explorer.scenes["Two rooms"]
    target, found = labkit.Target(scene.target), 0
    x, y, _ = labkit.to_xytheta(scene.T_reference)
    for dx, dy in (np.array(list(np.ndindex(15, 15))) - 7) / 7.0:
        run = labkit.icp(scene.source, target, labkit.transform(x + dx, y + dy, 0.0))
        error = labkit.to_xytheta(
            labkit.compose(labkit.invert(scene.T_reference), run.T_target_source)
        )
        found += bool(np.hypot(*error[:2]) <= 0.10 and abs(error[2]) <= np.radians(2.0))
    expect(status).to_contain_text(f"{found} of 225 guesses")
    page.get_by_label("overlap ρ").press("ArrowLeft")
    expect(status).to_contain_text("have changed since")
    page.get_by_label("overlap ρ").press("ArrowRight")
    expect(status).to_contain_text(f"{found} of 225 guesses")


def test_a_start_is_picked_from_the_basin_by_mouse_and_by_keyboard(page):
    page.get_by_label("scans", exact=True).select_option("The lesson's experiment")
    open_basin(page)
    page.get_by_role("button", name="Compute the basin").click()
    basin, status = page.locator(".icp-basin"), page.locator(".icp-more .icp-status")
    expect(status).to_contain_text("of 225", timeout=60000)
    box = basin.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 49.0, box["y"] + 40.0)
    x, y, turn = guess(page)
    assert (x, y, turn) == pytest.approx((0.35 - 1.0, 0.10 + 6 / 7, 3.0), abs=0.15)
    basin.focus()
    for key in ("ArrowRight", "ArrowUp", "ArrowUp"):
        page.keyboard.press(key)
    expect(status).to_contain_text("This start ends at: the answer")
    page.keyboard.press("Enter")
    assert guess(page) == pytest.approx((0.35 + 1 / 7, 0.10 + 2 / 7, turn), abs=2e-3)


def test_it_follows_the_page_s_theme(page):
    root, before = page.locator(".icp-explorer"), picture(page)
    background = "node => getComputedStyle(node).backgroundColor"
    assert root.evaluate(background) == "rgb(255, 255, 255)"
    page.evaluate("() => { document.documentElement.dataset.theme = 'dark'; }")
    expect(root).to_have_css("background-color", "rgb(20, 24, 30)")
    assert picture(page) != before


def bottom(page: Page, part: str) -> float:
    box = page.locator(part).bounding_box()
    assert box is not None
    return box["y"] + box["height"]


def test_all_of_it_fits_a_laptop_s_screen(page, explorer):
    page.set_viewport_size({"width": 1366, "height": 768})
    for name in explorer.scenes:
        page.get_by_label("scans", exact=True).select_option(name)
        page.get_by_role("button", name="End").click()
        box = page.locator(".icp-explorer").bounding_box()
        assert box is not None
        assert box["height"] <= 700.0, name


def test_it_fits_a_telephone_and_stays_off_paper(page):
    page.set_viewport_size({"width": 390, "height": 844})
    page.evaluate(TWO_FRAMES)
    assert page.evaluate(FIT)
    assert bottom(page, ".icp-sliders") - bottom(page, ".icp-top") < 700.0
    page.emulate_media(media="print")
    expect(page.locator(".icp-explorer")).to_be_hidden()


def test_every_control_has_a_name(page):
    assert page.locator(".icp-explorer").evaluate(NAMELESS) == []
    spoken = page.locator(".icp-spoken")
    expect(spoken).to_contain_text("28 iterations, converged", timeout=3000)


def test_keys_and_clicks_stay_inside(page):
    """JupyterLab would take focus away and move to the next cell."""
    heard = """() => {
        window.heard = [];
        for (const type of ["mousedown", "focusin", "keydown"])
            document.body.addEventListener(type, () => window.heard.push(type));
    }"""
    page.evaluate(heard)
    page.get_by_label("gate").click()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("() => window.heard") == []
