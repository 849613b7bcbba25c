"""JavaScript and style sheets as a widget ships them, with the constants of labkit's core."""

from __future__ import annotations

import json
import re
from pathlib import Path

from labkit import alignment, correspondences, degeneracy, line_alignment, normals, schedule
from labkit.plotting.style import css_variables
from labkit.result import Termination

FOLDER = Path(__file__).resolve().parent
# What a slider can move of a run, by its name in `IcpParameters`.
SLIDERS = ("metric", "max_correspondence_distance", "overlap_ratio", "huber_delta", "approach")
IMPORT = re.compile(r"^import\s[^;]*?\sfrom \"(\.\.?/[\w/]+\.js)\";\n", re.MULTILINE)
CONSTANTS = {
    alignment: "RELATIVE_RESOLUTION",
    correspondences: "MIN_PAIRS",
    line_alignment: "MIN_INFORMATION STEADY_SHARE STEADY_INFORMATION BUT_FOR_ROUNDING",
    degeneracy: "SHIFT",
    schedule: "LONG_STEP DELTA_PER_MEDIAN GATE_PER_DELTA POINT_SHARE COARSE_POINTS",
    normals: "HALF_WIDTH HALF_BEAMS MAX_NEIGHBOR_DISTANCE GAP_RATIO GAP_FLOOR LINEARITY "
    "MIN_ON_LINE",
}


def constants() -> str:
    """The module ``constants.js``: what labkit and the page share stands in labkit alone."""
    told: dict[str, object] = {each.name: each.value for each in Termination}
    shared = {name: getattr(m, name) for m, names in CONSTANTS.items() for name in names.split()}
    values = {"TERMINATIONS": told, "SLIDERS": SLIDERS, **shared}
    return "".join(f"export const {k} = {json.dumps(v)};\n" for k, v in values.items())


def bundle(entry: str) -> str:
    """A JavaScript module and all that it imports, as the one that a widget may have."""
    texts = {FOLDER / "explorer" / "constants.js": constants()}

    def add(path: Path) -> None:
        text = path.read_text("utf-8")
        for name in IMPORT.findall(text):
            if (wanted := (path.parent / name).resolve()) not in texts:
                add(wanted)
        texts[path] = IMPORT.sub("", text)

    add(FOLDER / entry)
    return "\n".join(texts.values())


def style(*names: str) -> str:
    """Style sheets, below the colours; the explorer's is the first of all widgets."""
    sheets = ("explorer/explorer.css", *names)
    return css_variables() + "\n".join((FOLDER / name).read_text("utf-8") for name in sheets)
