"""Sliders that call Python: each redraws, shows its figures, and stays out of pages."""

from __future__ import annotations

import math
import re

import pytest

pytest.importorskip("ipywidgets")

import labkit
from labkit.interactive import icp_sliders
from labkit.registration import IcpParameters

TARGET = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0], [2.0, 5.0]]
SOURCE = [[0.1, 0.0], [4.1, 0.1], [0.1, 3.0], [4.1, 3.0], [2.0, 5.9]]


@pytest.fixture
def box():
    return icp_sliders(SOURCE, TARGET)


def parts(box):
    _, controls, figures, image = box.children
    return controls.children, figures, image


def test_it_starts_with_labkit_s_own_run(box):
    (gate, ratio, delta), figures, _ = parts(box)
    assert (gate.value, ratio.value, delta.value) == (0.5, 0.85, 0.2)
    expected = labkit.icp(SOURCE, TARGET)
    assert f"{expected.inlier_rmse:.4f} m over {expected.inlier_count} inliers" in figures.value
    assert expected.message in figures.value


@pytest.mark.parametrize("end", [0, -1])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_each_slider_redraws_at_both_its_ends(box, which, end):
    """The gate or the overlap decides about the outlier, δ about its weight."""
    sliders, figures, image = parts(box)
    sliders[1].value = 1.0 if which != 1 else 0.85
    sliders[0].value = 1.95 if which != 0 else 0.5
    before = figures.value, image.value
    sliders[which].value = sliders[which].options[end][1]
    told = IcpParameters(
        max_correspondence_distance=sliders[0].value,
        overlap_ratio=sliders[1].value,
        huber_delta=sliders[2].value,
    )
    expected = labkit.icp(SOURCE, TARGET, None, told)
    assert f"over {expected.inlier_count} inliers" in figures.value
    assert f"cost {expected.cost:.3g} m²" in figures.value
    assert (figures.value, image.value) != before


def test_a_run_that_fails_is_told_not_raised():
    box = icp_sliders(SOURCE, [[x + 50.0, y] for x, y in TARGET])
    _, figures, _ = parts(box)
    assert "failed: fewer than 3 correspondences are left" in figures.value


@pytest.mark.parametrize(
    ("gate", "ratio", "delta"),
    [(0.12, 0.85, 0.025), (0.02, 0.1, 0.001), (3.0, 1.0 / 3.0, 0.7), (0.1 + 0.2, 1.0, 0.03)],
)
def test_it_starts_at_the_parameters_wherever_they_lie(gate, ratio, delta):
    told = IcpParameters(max_correspondence_distance=gate, overlap_ratio=ratio, huber_delta=delta)
    sliders, figures, _ = parts(icp_sliders(SOURCE, TARGET, None, told))
    assert [slider.value for slider in sliders] == [gate, ratio, delta]
    assert labkit.icp(SOURCE, TARGET, None, told).message in figures.value
    for slider in sliders:
        values = [value for _, value in slider.options]
        labels = [label for label, _ in slider.options]
        assert values == sorted(values)
        assert len(set(labels)) == len(labels)


def test_what_is_off_starts_at_the_sliders_end():
    told = IcpParameters(max_correspondence_distance=math.inf, huber_delta=math.inf)
    (gate, _, delta), _, _ = parts(icp_sliders(SOURCE, TARGET, None, told))
    for slider in (gate, delta):
        assert (slider.label, slider.value) == ("off", math.inf)
        assert slider.options[-1] == ("off", math.inf)


def test_the_picture_says_what_it_shows(box):
    _, _, image = parts(box)
    assert re.search(r'alt="the matched scans: \d+ of 5 pairs kept"', image.value)


def test_a_page_hides_the_sliders_and_says_why(box):
    style, controls, _, _ = box.children
    assert "labkit-needs-kernel" in controls._dom_classes
    assert "html[data-content_root] .labkit-needs-kernel { display: none; }" in style.value
    assert "A page has no Python" in style.value
