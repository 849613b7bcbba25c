"""Sliders under the reader's hand, in notebooks and in pages without a kernel.

An ordinary slider calls Python when it moves, so in a page it is dead. What stands here brings
along, in JavaScript, all that it computes: `icp_explorer`, `icp_sliders` and `align_by_hand` the
ICP loop, `live_figure` what else a figure shows. This is the one package that imports anywidget,
and ipywidgets with it.
"""

try:
    import anywidget as _anywidget  # noqa: F401
except ImportError as error:
    from labkit.support.extras import MissingExtraError

    missing = error.name or "anywidget"
    raise MissingExtraError("what moves in a notebook", missing, "notebooks") from error

from labkit.interactive.driving import drive
from labkit.interactive.explorer.scenes import Scene, default_scenes, killian_scene
from labkit.interactive.explorer.widget import Explorer, align_by_hand, icp_explorer, icp_sliders
from labkit.interactive.live_figure import live_figure

__all__ = [
    "Explorer",
    "Scene",
    "align_by_hand",
    "default_scenes",
    "drive",
    "icp_explorer",
    "icp_sliders",
    "killian_scene",
    "live_figure",
]
