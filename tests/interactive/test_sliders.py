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


def test_they_start_with_labkit_s_own_run():
    sliders = icp_sliders(SOURCE, TARGET)
    expected = labkit.icp(SOURCE, TARGET)
    assert sliders.form == "sliders"
    assert sliders.parameters == IcpParameters()
    assert np.array_equal(sliders.run().T_target_source, expected.T_target_source)


def test_guess_parameters_and_truth_reach_the_page():
    told = IcpParameters(math.inf, 0.6, 0.025, metric="point_to_line")
    T_init, truth = labkit.transform(0.1, 0.0, 0.05), labkit.transform(0.2, 0.0, 0.0)
    prepared = labkit.Target(TARGET)
    sliders = icp_sliders(SOURCE, prepared, T_init, told, T_reference=truth, runs=False)
    assert (sliders.parameters, sliders.runs) == (told, False)
    assert sliders.max_correspondence_distance is None
    assert sliders.guess == pytest.approx([0.1, 0.0, 0.05])
    assert sliders.scene_data[0]["answer"] == pytest.approx([0.2, 0.0, 0.0])


def test_what_cannot_be_a_pose_is_refused():
    with pytest.raises(LabkitError, match="`T_reference`"):
        icp_sliders(SOURCE, TARGET, T_reference=np.ones((3, 3)))
