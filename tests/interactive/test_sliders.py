"""The three sliders: an explorer with one pair of scans, at parameters of the caller's."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("anywidget")

import labkit
from labkit import IcpParameters, LabkitError
from labkit.interactive import icp_sliders

TARGET = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0], [2.0, 5.0]]
SOURCE = [[0.1, 0.0], [4.1, 0.1], [0.1, 3.0], [4.1, 3.0], [2.0, 5.9]]


def test_guess_parameters_and_truth_reach_the_page():
    told = IcpParameters(math.inf, 0.6, 0.025, metric="point_to_line")
    T_init, truth = labkit.transform(0.1, 0.0, 0.05), labkit.transform(0.2, 0.0, 0.0)
    prepared = labkit.Target(TARGET)
    sliders = icp_sliders(SOURCE, prepared, T_init, told, T_reference=truth, runs=False)
    assert (sliders.parameters, sliders.runs) == (told, False)
    assert sliders.max_correspondence_distance is None
    assert sliders.guess == pytest.approx([0.1, 0.0, 0.05])
    assert sliders.scene_data[0]["answer"] == pytest.approx([0.2, 0.0, 0.0])


def test_other_sliders_reach_the_page_with_their_values():
    gates, turns = [0.1, math.inf], np.arange(0.0, 0.35, 0.1)
    sliders = icp_sliders(
        SOURCE, TARGET, sliders={"max_correspondence_distance": gates, "turn": turns}
    )
    assert sliders.sliders == {
        "max_correspondence_distance": [0.1, None],
        "turn": [0.0, 0.1, 0.2, 0.3],  # without the dust of adding up
    }
    assert icp_sliders(SOURCE, TARGET, sliders={}).sliders == {}


@pytest.mark.parametrize("sliders", [{"metric": [1.0, 2.0]}, {"x": [0.0]}])
def test_a_slider_that_cannot_be_is_named(sliders):
    with pytest.raises(LabkitError, match=f"{next(iter(sliders))!r}"):
        icp_sliders(SOURCE, TARGET, sliders=sliders)
