"""The explorer on the Python side: scenes, state, and what it refuses."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from functools import partial

import numpy as np
import pytest

pytest.importorskip("anywidget")


import labkit
from labkit import IcpParameters, LabkitError, Scan
from labkit.interactive import (
    Explorer,
    Scene,
    icp_explorer,
    icp_sliders,
    killian_scene,
    live_figure,
)
from labkit.interactive.controls import CONTROLS
from labkit.interactive.controls import NAMES as CONTROL_NAMES
from labkit.interactive.front_end import constants

ONE_POINT = Scan.from_points([[1.0, 0.0]])
CORNER = Scan.from_points([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [0.0, 3.0]])
T_INIT = labkit.transform(0.1, 0.0, 0.05)


def make_scene(name="corner", **changes):
    return Scene(**{"name": name, "source": CORNER, "target": CORNER, "T_init": T_INIT} | changes)


@pytest.fixture
def explorer():
    return icp_explorer([make_scene(), make_scene("again", T_init=np.eye(3))])


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("scene", "moon", "`scene` must be one of corner, again, got 'moon'"),
        ("overlap_ratio", 1.3, r"`overlap_ratio` must be in \(0, 1\], got 1.3"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_changes_nothing(explorer, name, value, message):
    value_before = getattr(explorer, name)

    with pytest.raises(LabkitError, match=message):
        setattr(explorer, name, value)

    assert getattr(explorer, name) == value_before


def test_a_scene_brings_its_guess(explorer):
    explorer.scene = "again"
    assert explorer.guess == [0.0, 0.0, 0.0]


def test_infinity_turns_a_parameter_off(explorer):
    explorer.huber_delta = math.inf
    assert (explorer.huber_delta, explorer.parameters.huber_delta) == (None, math.inf)


SLIDERS = partial(icp_sliders, CORNER, CORNER)
FIGURE = partial(live_figure, "cuts", {"cuts": range(8)}, label="", xlim=(0, 1), ylim=(0, 1))
REFUSED = {
    "at least one, no two of one name, got []": partial(icp_explorer, []),
    "no two of one name, got ['a', 'a']": partial(icp_explorer, [make_scene("a")] * 2),
    "`scenes[0]` must be of the class Scene": partial(icp_explorer, [CORNER]),
    "`parameters` must be of the class IcpParameters": partial(icp_explorer, parameters=0.5),
    "each scan of scene 'few' needs 3 points, got 1": partial(make_scene, "few", source=ONE_POINT),
    "`source` must be of the class Scan": partial(make_scene, source=CORNER.points),
    "`scan` must be a whole number of at least 1 and at most 3,872": partial(killian_scene, 0),
    "two values to each, got 'x': [0.0]": partial(SLIDERS, sliders={"x": [0.0]}),
    "`sliders['x']` must hold numbers, got ['a', 'b']": partial(SLIDERS, sliders={"x": ["a", "b"]}),
    "`sliders` must be of the class Mapping": partial(SLIDERS, sliders=["x"]),
    '`model` must be "turn", "trace", "outlier", "cuts" or "race", got': partial(
        live_figure, "tree", {}, label="", start=[], xlim=(0, 1), ylim=(0, 1)
    ),
    "`start` must have shape (1,), got (2,)": partial(FIGURE, start=[1, 2]),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_makes_no_widget_is_refused(killian, message):
    with pytest.raises(LabkitError, match=re.escape(message)):
        REFUSED[message]()


def test_a_recorded_scene_carries_the_reference(killian):
    scene = killian_scene(101, "a room")

    T_world_target, T_world_source = labkit.from_xytheta(killian.reference[100:102])
    assert scene.name == "Killian Court 101: a room"
    np.testing.assert_allclose(T_world_target @ scene.T_reference, T_world_source, atol=1e-12)


def test_guess_parameters_and_truth_reach_the_page():
    parameters = IcpParameters(math.inf, 0.6, 0.025, metric="point_to_line", max_iterations=7)
    truth = labkit.transform(0.2, 0.0, 0.0)

    widget = icp_sliders(CORNER, labkit.Target(CORNER), T_INIT, parameters, T_reference=truth)

    assert widget.parameters == parameters
    assert widget.max_correspondence_distance is None
    assert widget.guess == pytest.approx([0.1, 0.0, 0.05])
    assert widget.scene_data[0]["answer"] == pytest.approx([0.2, 0.0, 0.0])


@pytest.mark.parametrize("runs", [True, False])
def test_the_page_runs_the_loop_at_once_or_waits(runs):
    assert SLIDERS(runs=runs).runs is runs


def test_a_control_is_one_entry_that_python_and_the_page_share():
    page, widget = constants(), SLIDERS()

    for control in CONTROLS:
        assert Explorer.class_traits()[control.name].metadata["sync"]
        assert f'"name": "{control.name}", "kind": "{control.kind}"' in page
        for value in control.values:
            setattr(widget, control.name, value)
            assert getattr(widget, control.name) == value
    assert set(CONTROL_NAMES) == {
        field.name for field in fields(IcpParameters) if "label" in field.metadata
    }
