"""The first page's map: the sweeps of Killian Court under three sets of poses.

The poses are those of chapter 10: its cells are run up to the matches of its loops, which are
solved as its exercise asks. What they give is kept until these cells or labkit change. As a
command this draws the map with the loops closed, as README shows it, and the one of the odometry
alone, with which chapters 5 and 10 begin::

    python book/_ext/killian_map.py
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
from PIL import Image

import labkit
from labkit.course.exercises.graph import solve_graph
from labkit.evaluation import ate
from labkit.odometry import increments_between, integrate
from labkit.plotting import book_figure, map_points, plot_trajectory
from labkit.plotting.style import SOURCE, TARGET
from labkit.support.arrays import FloatArray

BOOK = Path(__file__).parents[1]
CHAPTER = BOOK.parent / "notebooks" / "10_closing.ipynb"
DATA = BOOK / "_static" / "vendor" / "killian" / "map.js"
PICTURE = BOOK / "_static" / "killian-closed.webp"
DRIFT = PICTURE.with_name("killian-map.png")
EVERY, RANGE_MAX = 6, 15.0  # every so many-th scan, every other beam, so far as this [m]
TURN = 0.58  # lays the building along the picture's width [rad]
LAST = "good"  # what the last cell that is run sets
SIGMA = np.array([0.05, 0.05, 0.01])  # of an edge [m, m, rad]
STEPS = 36  # that the reader can try: all beams, in cm
LIED = {
    1732: "ICP says that the robot stood still. Did it?",
    2222: "the robot turned by 131° between two sweeps, and ICP lost it. Turn the scan back.",
    2225: "the robot turned by 172° between two sweeps, and ICP lost it. Turn the scan back.",
    2436: "here the match of the odometry slipped by 80 cm. Does yours?",
}


def provide(*_: object) -> None:
    """Write the map's data as a script, unless the one that is there is of today's sources."""
    code = cells()
    package = Path(labkit.__file__).parent
    files = [Path(__file__), *sorted(package.glob("*.py")), *sorted(package.glob("odometry/*.py"))]
    sources = [path.read_text("utf-8") for path in files]
    mark = hashlib.sha256("\n".join([*code, *sources]).encode()).hexdigest()
    if DATA.exists() and mark in DATA.read_text("utf-8")[:100]:
        return
    DATA.parent.mkdir(parents=True, exist_ok=True)
    data = json.dumps(map_data(run_chapter(code)), ensure_ascii=False)
    DATA.write_text(f"// {mark}\nwindow.killianMap?.({data});\n", "utf-8")


def cells() -> list[str]:
    """The code of chapter 10 up to the matches of its loops, without what speaks to Jupyter."""
    code = []
    for cell in nbformat.read(CHAPTER, as_version=4).cells:
        if cell.cell_type == "code" and "%pip" not in cell.source:
            code.append(re.sub(r"(?m)^%.*", "", cell.source))
            if f"{LAST} = " in code[-1]:
                return code
    raise LookupError(f"no cell of {CHAPTER.name} sets '{LAST}', from which the map is drawn")


def run_chapter(code: list[str]) -> dict[str, Any]:
    """The variables that these cells set, by name, and the poses that close the map."""
    variables: dict[str, Any] = {}
    for cell in code:
        exec(cell, variables)
    good = variables["good"]
    poses = variables["run"].poses
    chain = np.column_stack([np.arange(len(poses) - 1), np.arange(1, len(poses))])
    edges = np.concatenate([chain, variables["pairs_told"][good]])
    measured = np.concatenate([variables["steps"], variables["found"][good, :3]])
    return variables | {"closed": solve_graph(poses, edges, measured, SIGMA)}


def map_data(variables: dict[str, Any]) -> dict[str, Any]:
    """Ranges of every 6th scan as bytes, and three sets of poses with their errors."""
    log = variables["log"]
    poses = {
        "What the wheels say": integrate(variables["prior"], log.reference[0]),
        "What scan matching finds": variables["run"].poses,
        "…and once places are recognised": variables["closed"],
    }
    ranges = np.stack([scan.ranges for scan in log.scans])
    thinned = np.where(ranges < RANGE_MAX, ranges, 0.0)[::EVERY, ::2]
    states = [
        {
            "name": name,
            "off": float(ate(rows, log.reference).translation.median),
            "poses": _base64(rows[::EVERY].astype("<f4")),
        }
        for name, rows in poses.items()
    ]
    return {
        "beams": thinned.shape[1],
        "reach": RANGE_MAX,
        "ranges": _base64(np.ceil(thinned * 255 / RANGE_MAX).astype(np.uint8)),
        "states": states,
        "every": EVERY,
        "turn": TURN,
        "total": len(ranges) - 1,
        "steps": steps(ranges, increments_between(log.reference)),
    }


def steps(ranges: FloatArray, motions: FloatArray) -> dict[str, Any]:
    """Steps to try by hand: some along the way where the robot moved, and those that lied."""
    distances = np.hypot(*motions[:, :2].T)
    blocks = np.array_split(np.arange(len(distances)), STEPS)
    longest = [block[distances[block].argmax()] for block in blocks]
    scans = np.unique([*(step + 1 for step in longest), *LIED])
    pairs = ranges[scans[:, None] - [1, 0]]
    in_cm = np.rint(100.0 * np.where(np.isfinite(pairs), pairs, 0.0))
    return {
        "scans": scans.tolist(),
        "lied": LIED,
        "ranges": _base64(in_cm.astype("<u2")),
        "motions": motions[scans - 1].round(4).tolist(),
    }


def _base64(array: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def draw(variables: dict[str, Any]) -> None:
    """Draw both maps; the closed one is for paper, README and readers without JavaScript, too."""
    log = variables["log"]
    T_page_map = labkit.transform(0.0, 0.0, TURN)
    poses = labkit.to_xytheta(T_page_map @ labkit.from_xytheta(variables["closed"]))
    figure = book_figure(3.9)
    ax = figure.subplots()
    x, y = map_points(poses, log.scans, range_max=RANGE_MAX).T
    ax.plot(-y, x, ",", color=TARGET, alpha=0.06)
    ax.plot(-poses[:, 1], poses[:, 0], color=SOURCE, linewidth=0.5)
    ax.plot(-poses[0, 1], poses[0, 0], "o", color=TARGET, markersize=5.0)
    ax.annotate(
        "start and end", (-poses[0, 1], poses[0, 0]), (5.0, 4.0), textcoords="offset points"
    )
    ax.set_aspect("equal")
    ax.set_axis_off()
    left, bottom = ax.get_xlim()[0], ax.get_ylim()[0]
    ax.plot([left, left + 50.0], [bottom, bottom], color=TARGET, linewidth=2.0)
    ax.text(left + 25.0, bottom + 2.0, "50 m", ha="center", va="bottom")
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=200)
    Image.open(picture).convert("RGB").quantize(64).convert("RGB").save(PICTURE, lossless=True)
    figure = book_figure(5.0)
    plot_trajectory(figure.subplots(), variables["run"].poses, log.scans, log.reference)
    figure.savefig(DRIFT, dpi=200)
    Image.open(DRIFT).convert("RGB").quantize(64).save(DRIFT, optimize=True)


if __name__ == "__main__":
    draw(run_chapter(cells()))
