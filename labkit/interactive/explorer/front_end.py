"""The explorer's JavaScript modules as the one module that a widget may have."""

from __future__ import annotations

import re
from pathlib import Path

FOLDER = Path(__file__).parent
MODULES = (
    "se2",
    "neighbors",
    "correspondences",
    "alignment",
    "line_alignment",
    "icp",
    "scene",
    "canvas",
    "controls",
    "state",
    "basin",
    "plane",
    "cost",
    "readouts",
    "by_hand",
    "explorer",
)
"""Each imports only from those before it; the last one exports the widget."""

_IMPORT = re.compile(r"^import\s[^;]*?\sfrom \"\./\w+\.js\";\n", re.MULTILINE)


def front_end() -> str:
    """The modules, one after the other, without the imports that this makes needless."""
    parts = (FOLDER.joinpath(f"{name}.js").read_text("utf-8") for name in MODULES)
    return "\n".join(_IMPORT.sub("", part) for part in parts)


def style() -> str:
    """The explorer's style sheet."""
    return FOLDER.joinpath("explorer.css").read_text("utf-8")
