"""Sliders that a notebook chose, in a page: those and no others, and what they change."""

from __future__ import annotations

import math

import numpy as np
import pytest
from playwright.sync_api import expect

import labkit
from labkit.interactive import icp_sliders, live_figure
from tests.book.mouse import drag, finger, middle
from tests.book.widget_page import FRAME, drawn, picture, readout, repeat_until, settle

SIGN = "[data-readout]"  # of a widget that is drawn
LESSON = labkit.simulation.lesson_experiment()


def test_a_slider_of_the_guess_shows_where_the_run_ends(show):
    sliders = {"turn": [-20.0, 0.0, 20.0], "max_correspondence_distance": [0.005, 0.5, math.inf]}
    explorer = icp_sliders(LESSON.source, LESSON.target, LESSON.T_init, sliders=sliders)
    page = show(explorer, SIGN, viewport={"width": 800, "height": 700})
    assert page.locator(".icp-sliders label").all_inner_texts() == ["guess turn", "gate"]
    for name, key, told in (
        ("gate", "Home", "0.005 m"),
        ("gate", "End", "off"),
        ("guess turn", "End", "20°"),
    ):
        page.get_by_label(name).press(key)
        expect(page.get_by_label(name)).to_have_attribute("aria-valuetext", told)
    explorer.guess = [*explorer.guess[:2], math.radians(20.0)]
    explorer.max_correspondence_distance = None
    result = explorer.run()
    ending = f"iteration {result.iterations} of {result.iterations}"
    expect(readout(page, "shown")).to_have_text(ending)
    x, y, theta = labkit.to_xytheta(result.T_target_source)
    pose = f"({x:.3f}, {y:.3f}) m, {math.degrees(theta):.2f}°"
    expect(readout(page, "pose")).to_have_text(pose.replace("-", "−"))


def test_a_live_figure_follows_its_sliders_and_the_hand(show):
    limits = {"start": (0, 0, 0), "xlim": (-8.0, 8.0), "ylim": (-8.0, 8.0)}
    values = {"turn [°]": range(-30, 31), "x [m]": [-0.5, 0.0, 0.5], "y [m]": [-0.5, 0.0, 0.5]}
    source, target = LESSON.source.points, LESSON.target.points
    figure = live_figure("turn", values, label="two scans", source=source, target=target, **limits)
    page = show(figure, SIGN, viewport={"width": 390, "height": 700})
    canvas, (turn, *shifts) = page.get_by_role("img"), map(page.get_by_label, values)
    before = picture(page, "canvas")
    turn.press("ArrowRight")
    moved = labkit.apply(labkit.transform(0.0, 0.0, math.radians(1.0)), source)
    median = np.median(labkit.Target(LESSON.target).search.query(moved)[1])
    expect(readout(page, "median distance")).to_have_text(f"{median:.3f} m")
    told = f"two scans; median distance: {median:.3f} m"
    expect(canvas).to_have_attribute("aria-label", told)
    expect(turn).to_have_attribute("aria-valuetext", "1")
    assert picture(page, "canvas") != before
    drag(page, middle(canvas), (12.0, -12.0))
    for shift in shifts:
        expect(shift).to_have_attribute("aria-valuetext", "0.5")
    page.get_by_role("button", name="Reset").click()
    expect(shifts[0]).to_have_attribute("aria-valuetext", "0.0")
    above, below = canvas.bounding_box(), turn.bounding_box()
    assert above["y"] + above["height"] < below["y"] < 700


STEPS = [k / 2 for k in range(-8, 9)]
THREE_POINTS = [[0.0, 0.0], [0.2, 0.1], [0.1, -0.2]]
WHAT_IS_HELD = {  # by a model: its sliders, the one that a drag to the right moves, and its data
    "turn": (("turn", "x", "y"), "x", {"source": THREE_POINTS, "target": [[0.3, 0.0], [4, 4]]}),
    "cuts": (("cuts", "x", "y"), "x", {"target": [[0.3, 0.0], [4, 4]]}),
    "outlier": (
        ("weight", "off"),
        "off",
        {"source": THREE_POINTS, "target": THREE_POINTS, "truth": [0, 0, 0], "row": 0},
    ),
}


@pytest.mark.parametrize("model", WHAT_IS_HELD)
@pytest.mark.parametrize(("share", "is_moved"), [(0.5, True), (0.02, False)], ids=["near", "far"])
def test_a_finger_drags_what_a_live_figure_holds_and_one_far_off_does_not(
    show, model, share, is_moved
):
    names, moved, data = WHAT_IS_HELD[model]
    values = {name: [0, 1, 2] for name in names[:-2]} | dict.fromkeys(names[-2:], STEPS)
    limits = {"start": [0] * len(names), "xlim": (-8.0, 8.0), "ylim": (-8.0, 8.0)}
    figure = live_figure(model, values, label="three points", **limits, **data)
    page = show(
        figure, SIGN, viewport={"width": 390, "height": 700}, has_touch=True, is_mobile=True
    )
    box = page.get_by_role("img").bounding_box()
    x, y = box["x"] + share * box["width"], box["y"] + share * box["height"]
    touch = finger(page)

    touch("Start", x, y)
    touch("Move", x + 60.0, y)
    touch("End", x + 60.0, y)
    settle(page)

    shown = page.get_by_label(moved).get_attribute("aria-valuetext")
    assert (shown != "0.0") == is_moved


def test_play_walks_one_slider_to_its_end_and_reset_forgets_the_way(show):
    limits = {"start": [1], "xlim": (-8.0, 8.0), "ylim": (-8.0, 8.0)}
    pairs = {"source": THREE_POINTS, "target": THREE_POINTS, "weights": [1.0, 2.0, 3.0]}
    figure = live_figure("trace", {"turn": range(5)}, label="turned", **limits, **pairs)
    page = show(figure, SIGN, by_hand=True)
    slider, first = page.get_by_role("slider"), drawn(page, ".icp-cost")

    play, pause = (page.get_by_role("button", name=name) for name in ("Play", "Pause"))
    seen = []

    def watch() -> None:
        seen.append(slider.get_attribute("aria-valuetext"))
        page.clock.run_for(FRAME)

    play.click()
    repeat_until(lambda: pause.count() == 0, watch, "the slider at its end")

    assert list(dict.fromkeys(seen)) == ["1", "2", "3"]
    page.clock.run_for(FRAME)
    expect(slider).to_have_attribute("aria-valuetext", "4")
    page.get_by_role("button", name="Reset").click()
    page.clock.run_for(2 * FRAME)
    expect(slider).to_have_attribute("aria-valuetext", "1")
    assert drawn(page, ".icp-cost") == first
