"""What moves under the reader's hand: sliders in notebooks, and in pages without a kernel.

An ordinary slider calls Python when it moves, so in a page it is dead. Three ways to live
stand here. `flipbook` draws every picture beforehand. `icp_explorer` brings the ICP loop
along in JavaScript. `icp_sliders` is the ordinary kind, for a running notebook. This is
the one package that imports ipywidgets and anywidget.
"""

try:
    import anywidget as _anywidget  # noqa: F401
    import ipywidgets as _ipywidgets  # noqa: F401
except ImportError as error:
    message = f"what moves in a notebook needs more: pip install 'labkit[notebooks]' ({error})"
    raise ImportError(message) from error

from labkit.interactive.explorer import Explorer, Scene, default_scenes, icp_explorer, killian_scene
from labkit.interactive.flipbook import flipbook
from labkit.interactive.sliders import icp_sliders

__all__ = [
    "Explorer",
    "Scene",
    "default_scenes",
    "flipbook",
    "icp_explorer",
    "icp_sliders",
    "killian_scene",
]
