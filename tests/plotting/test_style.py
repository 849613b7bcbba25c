"""The shared look, and the promise to leave pyplot alone."""

import subprocess
import sys

import pytest

from labkit.errors import InvalidParameterError
from labkit.plotting import book_figure
from labkit.plotting.pairs import STYLES
from labkit.plotting.quality import FALLBACKS
from labkit.plotting.style import COLORS, css_variables


def test_nothing_imports_pyplot():
    code = "import sys, labkit.plotting; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("height", [0.0, 51.0])
def test_a_figure_needs_a_height(height):
    with pytest.raises(InvalidParameterError, match=r"`height` must be in \(0, 50\] in, got"):
        book_figure(height)


def test_the_style_sheets_know_every_colour_on_either_ground():
    light, dark = css_variables().strip().split("\n")
    for name, (on_light, on_dark) in COLORS.items():
        assert f"--icp-{name}: {on_light};" in light
        assert f"--icp-{name}: {on_dark};" in dark


def test_fates_and_decisions_differ_without_their_colour():
    assert len({marker for _, _, marker, _ in STYLES.values()}) == len(STYLES)
    assert len({marker for _, marker in FALLBACKS.values()}) == len(FALLBACKS)
