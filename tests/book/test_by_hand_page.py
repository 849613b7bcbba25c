"""The first page's two scans: aligned by mouse, by keyboard, and by ICP."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page, expect

import labkit
from labkit.interactive import Explorer, align_by_hand, killian_scene
from tests.book.mouse import drag, middle
from tests.book.widget_page import FRAME, film, run_until, settle

OFF = float("inf")
TOLD = labkit.IcpParameters(overlap_ratio=0.8, max_correspondence_distance=OFF, huber_delta=OFF)
SIGN = ".icp-distance:has-text('m')"  # of a widget that is drawn
START = labkit.transform(1.5, -0.6, 0.3)  # from which ICP is stuck
NEAR = labkit.transform(0.9, -0.2, 0.1)

WATCH = """() => {
    window.seen = [];
    const number = document.querySelector(".icp-distance");
    new MutationObserver(() => window.seen.push(parseFloat(number.textContent)))
        .observe(number, { childList: true, characterData: true, subtree: true });
}"""

SEEN = """() => new Promise(told => new IntersectionObserver(
    ([each]) => each.isIntersecting && told(), { threshold: 0.6 },
).observe(document.querySelector(".icp-by-hand")))"""


@pytest.fixture(scope="module")
def pair() -> Explorer:
    return align_by_hand(replace(killian_scene(101), T_init=START), TOLD)


def misfit(pair: Explorer, T: np.ndarray) -> str:
    """Root mean square over the nearest four fifths: what ICP minimises."""
    (scene,) = pair.scenes.values()
    moved, target = labkit.apply(T, scene.source.points), scene.target.points
    squares = np.sort(((moved[:, None] - target) ** 2).sum(axis=2).min(axis=1))
    return f"{np.sqrt(squares[: int(0.8 * len(squares))].mean()):.3f} m"


def distance(page: Page) -> float:
    settle(page)
    return float(page.locator(".icp-distance").inner_text().removesuffix(" m"))


def test_the_number_falls_as_the_scans_meet_and_icp_that_is_stuck_says_so(show, pair):
    page = show(pair, SIGN, viewport={"width": 800, "height": 700}, reduced_motion="reduce")
    number, verdict = page.locator(".icp-distance"), page.locator(".icp-verdict")
    expect(number).to_have_text(misfit(pair, START))
    page.get_by_role("button", name="Let ICP finish").click()
    expect(verdict).to_have_text(re.compile("Stuck: 0.64 m from where the robot was"))
    expect(page.get_by_role("status")).to_have_text(verdict.inner_text())
    page.get_by_role("button", name="Start again").click()
    expect(number).to_have_text(misfit(pair, START))
    expect(verdict).not_to_contain_text("Stuck")
    seen = [distance(page)]
    drag(page, (middle(page.locator(".icp-plane"))[0] + 60.0, 60.0), (-38.0, -22.0))
    seen.append(distance(page))
    page.locator(".icp-plane").focus()
    for _ in range(8):
        page.keyboard.press("PageDown")
    seen.append(distance(page))
    assert seen[0] > seen[1] > seen[2]


def test_as_the_number_falls_it_is_warmer_and_as_it_rises_colder(show, pair):
    page = show(pair, SIGN, reduced_motion="reduce")
    words = []

    for key in ("ArrowLeft", "ArrowRight"):
        seen = [distance(page)]
        for _ in range(5):
            page.locator(".icp-plane").press(key)
            seen.append(distance(page))
        words.append("Warmer." if seen[-1] < seen[-4] else "Colder.")
        expect(page.locator(".icp-verdict")).to_have_text(words[-1])

    assert set(words) == {"Warmer.", "Colder."}


def test_icp_never_lets_its_number_rise_and_ends_found(show, pair):
    (scene,) = pair.scenes.values()
    run = labkit.icp(scene.source, scene.target, NEAR, TOLD)
    x, y, turn = labkit.to_xytheta(run.T_target_source)
    found = f"Found: the robot moved {np.hypot(x, y):.2f} m and turned {np.degrees(turn):.1f}°."
    page = show(align_by_hand(replace(scene, T_init=NEAR), TOLD), SIGN, by_hand=True)  # in motion
    page.locator(".icp-plane").focus()
    for key in ("ArrowLeft", "ArrowRight"):  # a touch, and it no longer beckons
        page.keyboard.press(key)
    page.clock.run_for(FRAME)
    page.evaluate(WATCH)
    page.get_by_role("button", name="Let ICP finish").click()
    run_until(page, ".icp-verdict", found)
    seen = page.evaluate("() => window.seen")
    assert len(seen) > 5
    assert seen == sorted(seen, reverse=True)


def test_the_first_press_finds_and_a_second_start_gets_stuck(show):
    starts = {"T_init": labkit.transform(1.0, -0.6, 0.3), "T_worse": START}  # as on the first page
    scene = replace(killian_scene(101), **starts)
    page = show(align_by_hand(scene, TOLD), SIGN, reduced_motion="reduce")
    finish = page.get_by_role("button", name="Let ICP finish")

    finish.click()
    expect(page.locator(".icp-verdict")).to_contain_text("Found: the robot moved 0.5")
    page.get_by_role("button", name="Try a worse start").click()
    finish.click()

    expect(page.locator(".icp-verdict")).to_contain_text("Stuck: 0.64 m")


def test_from_too_far_off_icp_says_that_it_gives_up(show, pair):
    (scene,) = pair.scenes.values()
    far = align_by_hand(replace(scene, T_init=labkit.transform(80.0, 0.0, 0.0)))
    page = show(far, ".icp-distance", reduced_motion="reduce")
    page.get_by_role("button", name="Let ICP finish").click()
    expect(page.locator(".icp-verdict")).to_contain_text("gives up")


def test_the_scan_beckons_once_and_lies_where_it_lay(show, pair):
    films = {}
    for motion in ("reduce", "no-preference"):
        page = show(pair, SIGN, reduced_motion=motion, by_hand=True)
        page.evaluate(SEEN)
        films[motion] = film(page, duration=2000)
        expect(page.locator(".icp-legend")).to_contain_text("left out: the farthest 20 %")

    still, moving = films.values()
    assert len(set(still)) == 1
    assert len(set(moving)) > 20
    assert moving[-1] == still[-1]
