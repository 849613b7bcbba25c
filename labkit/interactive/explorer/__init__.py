"""The ICP explorer, and its three sliders alone: a widget whose page computes the loop itself.

The front end stands in the ``*.js`` files beside this one. `icp.js` and what it imports
mirror labkit's modules stage by stage and are held to them by the tests; the rest draws.
"""

from labkit.interactive.explorer.front_end import front_end
from labkit.interactive.explorer.scenes import Scene, default_scenes, killian_scene
from labkit.interactive.explorer.widget import Explorer, align_by_hand, icp_explorer, icp_sliders

__all__ = [
    "Explorer",
    "Scene",
    "align_by_hand",
    "default_scenes",
    "front_end",
    "icp_explorer",
    "icp_sliders",
    "killian_scene",
]
