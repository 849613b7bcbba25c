"""A robot to drive through the lab's worlds; the page casts its rays and matches its scans."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import traitlets
from matplotlib.figure import Figure

from labkit.interactive.drawn import DrawnWidget
from labkit.interactive.explorer.widget import parameters_to_json, to_base64
from labkit.interactive.front_end import bundle, style
from labkit.parameters import ACCURATE
from labkit.plotting.style import SOURCE, TARGET, style_plane
from labkit.se2 import apply, from_xytheta
from labkit.simulation import (
    Lidar,
    WheelNoise,
    World,
    cast,
    corridor,
    doorways,
    room,
    two_rooms,
)

DRIVE_LIDAR = Lidar(beam_count=181, noise_std=0.03)  # a cheap one: a round shows how errors add up
WHEELS = {
    "good": WheelNoise(along=0.01, across=0.005, turn=0.01, drift=0.003),
    "noisy": WheelNoise(along=0.2, across=0.1, turn=0.2, drift=0.1),
}

PLACES: dict[str, tuple[World, tuple[float, float, float], str]] = {
    # where the drive starts, and what to try
    "Room": (
        room(),
        (2.0, -1.5, 1.6),
        "Drive a few rounds about the pillar, slowly.",
    ),
    "Corridor": (
        corridor(),
        (0.0, 0.0, 0.0),
        "Drive along the corridor, and watch the blue robot.",
    ),
    "Doorways": (
        doorways(period=0.8, opening=0.35),
        (0.1, 0.0, 0.0),
        "Drive straight on: slowly first, then at full speed.",
    ),
    "Two rooms": (
        two_rooms(),
        (-3.0, 0.5, 0.0),
        "Go through the door, round the other room, and back.",
    ),
}


class Drive(DrawnWidget):
    """A robot to drive; make one with `drive`."""

    _esm = bundle("driving/drive.js")
    _css = style("driving/drive.css")

    places: traitlets.List[Any] = traitlets.List().tag(sync=True)
    lidar = traitlets.Dict().tag(sync=True)
    wheels = traitlets.Dict().tag(sync=True)
    parameters = traitlets.Dict().tag(sync=True)

    def draw(self, figure: Figure) -> None:
        """Draw the first place with the robot at its start and its first scan."""
        name, (world, start, _) = next(iter(PLACES.items()))
        T = from_xytheta(start)
        ax = figure.subplots()
        for wall in world.segments.reshape(-1, 2, 2):
            ax.plot(*wall.T, color=TARGET, lw=1.5)
        ax.plot(*apply(T, cast(world, T, DRIVE_LIDAR, rng=0).points).T, "o", ms=3.0, color=SOURCE)
        ax.plot(*start[:2], "^", ms=9.0, color=SOURCE)
        style_plane(ax)
        ax.set_title(f"{name}: the robot at its start, and its first scan")


def drive() -> Drive:
    """A robot in the lab's worlds, under the reader's hand: by keys, mouse or thumb.

    The page casts 181 rays and matches each scan to the last one by the explorer's loop, with the
    odometry's own parameters.
    """
    return Drive(
        places=[
            {"name": name, "start": start, "hint": hint}
            | {"segments": to_base64(world.segments.reshape(-1, 4))}
            for name, (world, start, hint) in PLACES.items()
        ],
        lidar=asdict(DRIVE_LIDAR) | {"angles": DRIVE_LIDAR.angles.tolist()},
        wheels={name: asdict(noise) for name, noise in WHEELS.items()},
        parameters=parameters_to_json(ACCURATE),
    )
