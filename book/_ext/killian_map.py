"""The first page's map: the sweeps of Killian Court under three sets of poses.

The poses are those of chapter 10. They are kept until a module of labkit changes. As a
command this draws the map with the loops closed, as README shows it, and the one of the odometry
alone, with which chapters 5 and 10 begin::

    python book/_ext/killian_map.py
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import labkit
from labkit.course.loops import ClosedMap, close_map
from labkit.evaluation import ate
from labkit.odometry import increments_between, integrate
from labkit.plotting import book_figure, map_points, plot_trajectory
from labkit.plotting.style import SOURCE, TARGET
from labkit.support.arrays import FloatArray

BOOK = Path(__file__).parents[1]
DATA = BOOK / "_static" / "vendor" / "killian" / "map.js"
PICTURE = BOOK / "_static" / "killian-closed.webp"
DRIFT = PICTURE.with_name("killian-map.png")
EVERY, RANGE_MAX = 6, 15.0  # every so many-th scan, every other beam, so far as this [m]
TURN = 0.58  # lays the building along the picture's width [rad]
STEPS = 36  # that the reader can try: all beams, in cm
LIED = {
    1732: "ICP says that the robot stood still. Did it?",
    2222: "the robot turned by 131° between two sweeps, and ICP lost it. Turn the scan back.",
    2225: "the robot turned by 172° between two sweeps, and ICP lost it. Turn the scan back.",
    2436: "here the match of the odometry slipped by 80 cm. Does yours?",
}


def provide(*_: object) -> None:
    """Write the map's data as a script, unless the one that is there is of today's sources."""
    mark = fingerprint(Path(labkit.__file__).parent)
    if DATA.exists() and mark in DATA.read_text("utf-8")[:100]:
        return
    DATA.parent.mkdir(parents=True, exist_ok=True)
    data = json.dumps(map_data(close_map()), ensure_ascii=False)
    DATA.write_text(f"// {mark}\nwindow.killianMap?.({data});\n", "utf-8")


def fingerprint(package: Path) -> str:
    """A mark of this file and of every module of a package: any of them may move a pose."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted(package.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def map_data(drive: ClosedMap) -> dict[str, Any]:
    """Ranges of every 6th scan as bytes, and three sets of poses with their errors."""
    log = drive.log
    poses = {
        "What the wheels say": integrate(drive.prior, log.reference[0]),
        "What scan matching finds": drive.run.poses,
        "…and once places are recognised": drive.closed,
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


def draw(drive: ClosedMap) -> None:
    """Draw both maps; the closed one is for paper, README and readers without JavaScript, too."""
    log = drive.log
    T_page_map = labkit.transform(0.0, 0.0, TURN)
    poses = labkit.to_xytheta(T_page_map @ labkit.from_xytheta(drive.closed))
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
    plot_trajectory(figure.subplots(), drive.run.poses, log.scans, log.reference)
    figure.savefig(DRIFT, dpi=200)
    Image.open(DRIFT).convert("RGB").quantize(64).save(DRIFT, optimize=True)


if __name__ == "__main__":
    draw(close_map())
