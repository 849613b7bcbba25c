"""The shared look, and the promise to leave pyplot alone."""

import subprocess
import sys
from itertools import pairwise

import pytest

from labkit.errors import InvalidParameterError
from labkit.plotting import book_figure
from labkit.plotting.pairs import STYLES
from labkit.plotting.quality import FALLBACKS
from labkit.plotting.style import COLORS, css_variables, legend_below


def test_nothing_imports_pyplot():
    code = "import sys, labkit.plotting; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("height", [0.0, 51.0])
def test_a_figure_needs_a_height(height):
    with pytest.raises(InvalidParameterError, match=r"`height` must be in \(0, 50\] in, got"):
        book_figure(height)


@pytest.mark.parametrize("panels", [1, 3])
def test_a_legend_stays_below_its_axes_and_inside_the_figure(panels):
    figure = book_figure(4.0)
    for ax in figure.subplots(1, panels, squeeze=False)[0]:
        for name in ("first", "second", "a third one", "the fourth of all"):
            ax.plot([0.0, 1.0], [0.0, 1.0], label=name)
        ax.set_xlabel("x [m]")
        legend_below(ax)
    figure.draw_without_rendering()
    boxes = [ax.get_legend().get_window_extent() for ax in figure.axes]
    for ax, box in zip(figure.axes, boxes, strict=True):
        assert box.y1 <= ax.xaxis.label.get_window_extent().y0 + 1.0
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1
        assert box.y0 >= figure.bbox.y0
    for left, right in pairwise(boxes):
        assert left.x1 <= right.x0


def test_the_style_sheets_know_every_colour_on_either_ground():
    light, dark = css_variables().strip().split("\n")
    for name, (on_light, on_dark) in COLORS.items():
        assert f"--icp-{name}: {on_light};" in light
        assert f"--icp-{name}: {on_dark};" in dark


def test_fates_and_decisions_differ_without_their_colour():
    assert len({marker for _, _, marker, _ in STYLES.values()}) == len(STYLES)
    assert len({marker for _, marker in FALLBACKS.values()}) == len(FALLBACKS)
