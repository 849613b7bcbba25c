"""Sliders that a notebook chose, in a page: those and no others, and what they change."""

from __future__ import annotations

import math

import numpy as np
from mouse import drag, middle
from playwright.sync_api import Page
from widget_page import TWO_FRAMES

import labkit
from labkit.interactive import icp_sliders, live_figure

SIGN = "[data-readout]"  # of a widget that is drawn
LESSON = labkit.simulation.lesson_experiment()


def readout(page: Page, name: str) -> str:
    page.evaluate(TWO_FRAMES)
    return page.locator(f"[data-readout='{name}']").inner_text()


def test_a_slider_of_the_guess_shows_where_the_run_ends(show):
    sliders = {"turn": [-20.0, 0.0, 20.0], "max_correspondence_distance": [0.005, 0.5, math.inf]}
    explorer = icp_sliders(LESSON.source, LESSON.target, LESSON.T_init, sliders=sliders)
    page = show(explorer, SIGN, viewport={"width": 800, "height": 700})
    assert page.locator(".icp-sliders label").all_inner_texts() == ["guess turn", "gate"]
    page.get_by_label("gate").press("Home")
    page.evaluate(TWO_FRAMES)
    assert page.get_by_label("gate").get_attribute("aria-valuetext") == "0.005 m"
    page.get_by_label("gate").press("End")
    page.get_by_label("guess turn").press("End")
    explorer.guess = [*explorer.guess[:2], math.radians(20.0)]
    explorer.max_correspondence_distance = None
    result = explorer.run()
    assert readout(page, "shown") == f"iteration {result.iterations} of {result.iterations}"
    assert page.get_by_label("guess turn").get_attribute("aria-valuetext") == "20°"
    x, y, theta = labkit.to_xytheta(result.T_target_source)
    pose = f"({x:.3f}, {y:.3f}) m, {math.degrees(theta):.2f}°"
    assert readout(page, "pose").replace("−", "-") == pose


def test_a_live_figure_follows_its_sliders_and_the_hand(show):
    figure = live_figure(
        "turn",
        {"turn [°]": range(-30, 31), "x [m]": [-0.5, 0.0, 0.5], "y [m]": [-0.5, 0.0, 0.5]},
        label="two scans",
        start=(0, 0, 0),
        xlim=(-8.0, 8.0),
        ylim=(-8.0, 8.0),
        source=LESSON.source.points,
        target=LESSON.target.points,
    )
    page = show(figure, SIGN, viewport={"width": 390, "height": 700})
    picture = page.get_by_role("img", name="two scans")
    before = picture.evaluate("canvas => canvas.toDataURL()")
    page.get_by_label("turn [°]").press("ArrowRight")
    T = labkit.transform(0.0, 0.0, math.radians(1.0))
    moved = labkit.apply(T, LESSON.source.points)
    median = np.median(labkit.Target(LESSON.target).search.query(moved)[1])
    assert readout(page, "median distance") == f"{median:.3f} m"
    assert picture.get_attribute("aria-label") == f"two scans; median distance: {median:.3f} m"
    assert page.get_by_label("turn [°]").get_attribute("aria-valuetext") == "1"
    assert picture.evaluate("canvas => canvas.toDataURL()") != before
    x, y = middle(picture)
    drag(page, (x, y), (12.0, -12.0))
    page.evaluate(TWO_FRAMES)
    assert page.get_by_label("x [m]").get_attribute("aria-valuetext") == "0.5"
    assert page.get_by_label("y [m]").get_attribute("aria-valuetext") == "0.5"
    page.get_by_role("button", name="Reset").click()
    page.evaluate(TWO_FRAMES)
    assert page.get_by_label("x [m]").get_attribute("aria-valuetext") == "0.0"
    boxes = [each.bounding_box() for each in (picture, page.get_by_label("turn [°]"))]
    assert boxes[0]
    assert boxes[1]
    assert boxes[0]["y"] + boxes[0]["height"] < boxes[1]["y"] < 700
