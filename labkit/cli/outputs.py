"""The files of a run: trajectory, quality and map, each written whole or not at all."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np

from labkit.arrays import FloatArray
from labkit.cli.quality import write_quality
from labkit.errors import WriteError
from labkit.files import refuse_unwritable
from labkit.logs import Log, LogStream, write_g2o, write_tum
from labkit.odometry import OdometryResult, increments_between

NOTHING = "none"  # the word for no file
MOST_DRAWN = 5000  # scans in a map: a picture shows no more, and a long log would fill the memory
Writer = Callable[[str, Log | LogStream, OdometryResult], None]


def add_output_options(parser: argparse.ArgumentParser) -> None:
    """Add one option for each file."""
    group = parser.add_argument_group("output, in this folder by default; `none` writes nothing")
    group.add_argument("--out", metavar="FILE", help="trajectory, TUM or .g2o (LOG-odometry.tum)")
    group.add_argument("--quality", metavar="FILE", help="a CSV row a step (LOG-quality.csv)")
    group.add_argument("--plot", metavar="FILE", help="map and trajectory (LOG-map.png)")


def choose_outputs(args: argparse.Namespace, name: str) -> list[tuple[str, Writer]]:
    """The files that were asked for and what writes each; raise where one cannot be written.

    Called before the work begins: a typing mistake must not cost a long run.
    """
    outputs: list[tuple[str, Writer]] = [
        (args.out or f"{name}-odometry.tum", write_trajectory),
        (args.quality or f"{name}-quality.csv", _write_quality),
        (args.plot or f"{name}-map.png", write_map),
    ]
    wanted = [(path, writer) for path, writer in outputs if path != NOTHING]
    taken = {Path(args.log).resolve(): "is the log itself"}
    for path, writer in wanted:
        refuse_unwritable(path)
        if (place := Path(path).resolve()) in taken:
            raise WriteError(f"cannot write {path}: it {taken[place]}; give each file its own name")
        taken[place] = "is written by this run already"
        if writer is write_map:
            from labkit.plotting.save import figure_suffix  # noqa: PLC0415 (matplotlib is slow)

            figure_suffix(path)
    return wanted


def write_trajectory(path: str, log: Log | LogStream, result: OdometryResult) -> None:
    """Write the poses, as g2o where the suffix says so, else as TUM."""
    if path.endswith(".g2o"):
        write_g2o(path, result.poses, increments_between(result.poses))
    else:
        write_tum(path, _stamps(log), result.poses)


def write_map(path: str, log: Log | LogStream, result: OdometryResult) -> None:
    """Draw the scans at the estimated poses, the trajectory and the reference."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    from labkit.plotting import plot_trajectory, save_figure  # noqa: PLC0415

    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    ax = figure.add_subplot()
    every = -(-len(log) // MOST_DRAWN)
    plot_trajectory(
        ax,
        result.poses[::every],
        scans=list(islice(log.scans, None, None, every)),
        reference=log.reference,
    )
    ax.set_title(f"{log.name}: map and trajectory by scan matching")
    save_figure(figure, path)


def _write_quality(path: str, log: Log | LogStream, result: OdometryResult) -> None:
    write_quality(path, _stamps(log), result.records)


def _stamps(log: Log | LogStream) -> FloatArray:
    """The scans' times [s], or their numbers where the log has no times."""
    return np.arange(len(log), dtype=float) if np.isnan(log.stamps).any() else log.stamps
