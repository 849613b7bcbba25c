"""The first page's two scans: aligned by mouse, by keyboard, and by ICP."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from mouse import drag, middle
from playwright.sync_api import Browser, Page, expect

pytest.importorskip("anywidget")
pytest.importorskip("rtbdata")

from widget_page import written_page

import labkit
from labkit.interactive import Explorer, align_by_hand, killian_scene
from labkit.neighbors import nearest_by_brute_force

START = labkit.transform(1.5, -1.0, 0.44)


@pytest.fixture(scope="module")
def pair() -> Explorer:
    return align_by_hand(replace(killian_scene(101), T_init=START))


@pytest.fixture(scope="module")
def address(pair: Explorer, tmp_path_factory: pytest.TempPathFactory) -> str:
    return written_page(pair, tmp_path_factory.mktemp("page"))


@pytest.fixture
def page(browser: Browser, address: str) -> Iterator[Page]:
    page = browser.new_page(viewport={"width": 800, "height": 700}, reduced_motion="reduce")
    complaints: list[str] = []
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: complaints.append(str(e)))
    page.goto(address)
    page.locator(".icp-distance", has_text="m").wait_for()
    yield page
    page.close()
    assert complaints == []


def mean_distance(pair: Explorer, T: np.ndarray) -> str:
    (scene,) = pair.scenes.values()
    moved, target = labkit.apply(T, scene.source.points), scene.target.points
    nearest = target[nearest_by_brute_force(moved, target)]
    return f"{np.linalg.norm(moved - nearest, axis=1).mean():.3f} m"


def distance(page: Page) -> float:
    page.evaluate("() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")
    return float(page.locator(".icp-distance").inner_text().removesuffix(" m"))


def test_the_number_is_the_mean_distance_and_falls_as_the_scans_meet(page, pair):
    expect(page.locator(".icp-distance")).to_have_text(mean_distance(pair, START))
    first = distance(page)
    drag(page, (middle(page.locator(".icp-plane"))[0] + 60.0, 60.0), (-38.0, -38.0))
    dragged = distance(page)
    assert dragged < first
    page.locator(".icp-plane").focus()
    for _ in range(20):
        page.keyboard.press("PageDown")
    assert distance(page) < dragged
    best = page.locator("[data-readout=best]").inner_text()
    page.locator(".icp-plane").press("PageUp")
    page.locator(".icp-plane").press("ArrowRight")
    assert distance(page) > float(best.removesuffix(" m"))
    assert page.locator("[data-readout=best]").inner_text() == best


def test_icp_goes_on_from_where_the_scan_lies(page, pair):
    page.get_by_role("button", name="Let ICP go on").click()
    (scene,) = pair.scenes.values()
    run = labkit.icp(scene.source, scene.target, START)
    ends = mean_distance(pair, run.T_target_source)
    expect(page.locator("[data-readout=ICP]")).to_have_text(
        f"{ends} after {run.iterations} iterations"
    )
    expect(page.locator(".icp-distance")).to_have_text(ends)
    page.get_by_role("button", name="Start again").click()
    expect(page.locator(".icp-distance")).to_have_text(mean_distance(pair, START))
    expect(page.locator("[data-readout=ICP]")).to_have_text("not asked yet")


def test_from_too_far_off_icp_says_that_it_gives_up(browser, pair, tmp_path):
    (scene,) = pair.scenes.values()
    far = replace(scene, T_init=labkit.transform(80.0, 0.0, 0.0))
    page = browser.new_page(reduced_motion="reduce")
    page.goto(written_page(align_by_hand(far), tmp_path))
    page.get_by_role("button", name="Let ICP go on").click()
    expect(page.locator("[data-readout=ICP]")).to_contain_text("gives up")
    page.close()
