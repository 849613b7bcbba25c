"""The explorer's JavaScript modules as the one module that a widget may have."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from labkit.plotting.style import css_variables

FOLDER = Path(__file__).parent
MODULES = (
    *("se2", "neighbors", "correspondences", "alignment", "line_alignment", "icp", "scene"),
    *("canvas", "controls", "frame", "state", "bets", "basin", "plane", "cost", "readouts"),
    *("tasks", "by_hand", "explorer"),
)
"""Each imports only from those before it; the last one exports the widget."""

_IMPORT = re.compile(r"^import\s[^;]*?\sfrom \"\./[\w/]+\.js\";\n", re.MULTILINE)


def joined(files: Iterable[Path]) -> str:
    """Modules one after the other, without the imports that this makes needless."""
    return "\n".join(_IMPORT.sub("", path.read_text("utf-8")) for path in files)


def front_end() -> str:
    """The explorer's modules as one."""
    return joined(FOLDER / f"{name}.js" for name in MODULES)


def style() -> str:
    """The explorer's style sheet, below the colours."""
    return css_variables() + FOLDER.joinpath("explorer.css").read_text("utf-8")
