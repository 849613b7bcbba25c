"""The pictures that widgets bring for paper and for programs that run no script."""

import base64
import io

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from labkit import IcpParameters
from labkit.interactive import (
    align_by_hand,
    default_scenes,
    drive,
    icp_explorer,
    icp_sliders,
    live_figure,
)
from labkit.plotting.style import SOURCE, TARGET
from labkit.simulation import lesson_experiment

LESSON = lesson_experiment()
LOOK = {"label": "moved", "start": (0, 0, 0), "xlim": (-2, 8), "ylim": (-2, 8)}
SLIDERS = {"turn": range(3), "x": range(3), "y": range(3)}
WALL = np.column_stack([np.linspace(0.0, 5.0, 200), np.zeros(200)])
NARROW = IcpParameters(max_correspondence_distance=1e-6)
POINTS = {"source": LESSON.source.points, "target": LESSON.target.points}
MAKERS = {
    "explorer": lambda: icp_explorer([scene()]),
    "by hand": lambda: align_by_hand(scene()),
    "sliders": lambda: icp_sliders(LESSON.source, LESSON.target),
    "sliders of pairs": lambda: icp_sliders(LESSON.source, LESSON.target, runs=False),
    "a run that fails": lambda: icp_sliders(WALL, WALL + 1.0, parameters=NARROW),
    "a wall along an axis": lambda: icp_sliders(2.0 * WALL, WALL, runs=False),
    "live figure": lambda: live_figure("turn", SLIDERS, **LOOK, **POINTS),
    "drive": drive,
}


def scene():
    """Read where a test asks for it: it stands in the log of Killian Court."""
    return default_scenes()[1]


@pytest.mark.parametrize("name", MAKERS)
def test_a_widget_brings_a_picture_of_both_scans(name):
    data, _ = MAKERS[name]()._repr_mimebundle_()

    picture = Image.open(io.BytesIO(base64.b64decode(data["image/png"])))

    pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    for color in (SOURCE, TARGET):
        near = np.abs(pixels / 255.0 - to_rgb(color)).max(axis=1) < 0.05
        assert near.sum() > 100
