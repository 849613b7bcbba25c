"""JavaScript and style sheets as a widget ships them, with the constants of labkit's core."""

from __future__ import annotations

import json
import re
from pathlib import Path

from labkit import alignment, correspondences, degeneracy, line_alignment, normals, schedule
from labkit.interactive.controls import CONTROLS
from labkit.plotting.style import css_variables
from labkit.result import Termination

FOLDER = Path(__file__).resolve().parent
IMPORT = re.compile(r"^import\s[^;]*?\sfrom \"(\.\.?/[\w/]+\.js)\";\n", re.MULTILINE)
CONSTANTS = {  # by the module that defines them
    alignment: "RELATIVE_RESOLUTION",
    correspondences: "MIN_PAIRS",
    line_alignment: "MIN_INFORMATION STEADY_SHARE STEADY_INFORMATION BUT_FOR_ROUNDING",
    degeneracy: "MAX_TURN_OF_SHIFT",
    schedule: "LONG_STEP DELTA_PER_MEDIAN GATE_PER_DELTA POINT_SHARE COARSE_POINTS",
    normals: "CORE_PER_NOISE FILLED GAP_FLOOR GAP_RATIO HALF_BEAMS HALF_WIDTH LINEARITY "
    "MAX_NEIGHBOR_DISTANCE MAX_WIDTH MIN_ON_LINE MIN_SPACING NEIGHBORS SAMPLE_SIZE SHRINKAGE "
    "SPARSE_WIDTH_PER_NOISE STEADY WIDE_LINEARITY WIDTH_PER_NOISE",
}


def constants() -> str:
    """Text of the module ``constants.js``: what labkit defines and the page shares."""
    values: dict[str, object] = {
        "TERMINATIONS": {ending.name: ending.value for ending in Termination},
        "CONTROLS": [control.to_json() for control in CONTROLS],
    }
    for module, names in CONSTANTS.items():
        values |= {name: getattr(module, name) for name in names.split()}
    return "".join(
        f"export const {name} = {json.dumps(value)};\n" for name, value in values.items()
    )


def bundle(entry: str) -> str:
    """Text of a JavaScript module and all that it imports: a widget may have one module only."""
    texts = {FOLDER / "explorer" / "constants.js": constants()}

    def add(path: Path) -> None:
        text = path.read_text("utf-8")
        for name in IMPORT.findall(text):
            imported = (path.parent / name).resolve()
            if imported not in texts:
                add(imported)
        texts[path] = IMPORT.sub("", text)

    add(FOLDER / entry)
    return "\n".join(texts.values())


def style(*names: str) -> str:
    """Text of the colours and style sheets; every widget begins with the explorer's."""
    sheets = ("explorer/explorer.css", *names)
    return css_variables() + "\n".join((FOLDER / name).read_text("utf-8") for name in sheets)
