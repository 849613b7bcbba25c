"""The explorer on the Python side: scenes, state, what it refuses, and its one module."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

pytest.importorskip("anywidget")


import labkit
from labkit import IcpParameters, LabkitError, Scan
from labkit.interactive import Scene, icp_explorer, icp_sliders, killian_scene

ONE = Scan.from_points([[1.0, 0.0]])
CORNER = Scan.from_points([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [0.0, 3.0]])


def scene(name="corner", **changes):
    known = {"source": CORNER, "target": CORNER, "T_init": labkit.transform(0.1, 0.0, 0.05)}
    return Scene(name=name, **known | changes)


@pytest.fixture
def explorer():
    return icp_explorer([scene(), scene("again", T_init=np.eye(3))])


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("scene", "moon", "`scene` must be one of corner, again, got 'moon'"),
        ("overlap_ratio", 1.3, r"`overlap_ratio` must be in \(0, 1\], got 1.3"),
    ],
)
def test_what_cannot_be_meant_is_refused_and_changes_nothing(explorer, name, value, message):
    before = getattr(explorer, name)
    with pytest.raises(LabkitError, match=message):
        setattr(explorer, name, value)
    assert getattr(explorer, name) == before
    explorer.scene = "again"  # which brings its guess
    assert explorer.guess == [0.0, 0.0, 0.0]


REFUSED = {
    "at least one, no two of one name, got []": lambda: icp_explorer([]),
    "at least one, no two of one name, got ['a', 'a']": lambda: icp_explorer([scene("a")] * 2),
    "each scan of scene 'few' needs 3 points, got 1": lambda: scene("few", source=ONE),
    "`scan` must be in [1, 3872], got 0": lambda: killian_scene(0),
    "two values to each, got 'x': [0.0]": lambda: icp_sliders(CORNER, CORNER, sliders={"x": [0.0]}),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_makes_no_widget_is_refused(killian, message):
    with pytest.raises(LabkitError, match=re.escape(message)):
        REFUSED[message]()


def test_a_recorded_scene_carries_the_reference(killian):
    recorded = killian_scene(101, "a room")
    before, now = labkit.from_xytheta(killian.reference[100:102])
    assert recorded.name == "Killian Court 101: a room"
    assert np.allclose(before @ recorded.T_reference, now, rtol=0, atol=1e-12)


def test_guess_parameters_and_truth_reach_the_page():
    told = IcpParameters(math.inf, 0.6, 0.025, metric="point_to_line", max_iterations=7)
    T_init, truth = labkit.transform(0.1, 0.0, 0.05), labkit.transform(0.2, 0.0, 0.0)
    prepared = labkit.Target(CORNER)
    sliders = icp_sliders(CORNER, prepared, T_init, told, T_reference=truth, runs=False)
    assert (sliders.parameters, sliders.runs) == (told, False)
    assert sliders.max_correspondence_distance is None
    assert sliders.guess == pytest.approx([0.1, 0.0, 0.05])
    assert sliders.scene_data[0]["answer"] == pytest.approx([0.2, 0.0, 0.0])
