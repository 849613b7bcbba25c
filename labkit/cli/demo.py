"""``labkit demo``: the lesson's experiment, whose truth is known."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

import numpy as np

from labkit.cli.options import add_icp_options, from_options
from labkit.cli.text import pose_text
from labkit.files import refuse_unwritable
from labkit.icp import icp
from labkit.parameters import IcpParameters
from labkit.result import IcpResult
from labkit.se2 import to_xytheta
from labkit.simulation import LessonExperiment, lesson_experiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Match two simulated scans of an L-shaped corner with scattered points: 600 world points,
1 cm of noise, spurious returns, a guess that is 3 degrees and 18 cm off. Change a
parameter and watch the estimate follow: `labkit demo --gate off --overlap 1`."""


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``demo`` to the command line."""
    parser = commands.add_parser(
        "demo",
        help="match the lesson's two simulated scans and compare with the truth",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--plot", metavar="FILE", help="draw the scans before and after")
    parser.add_argument("--animate", metavar="FILE", help="draw the iterations (.gif or .html)")
    add_icp_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the experiment and print what came of it."""
    experiment = lesson_experiment()
    parameters = from_options(IcpParameters, args)
    _check_pictures(args)
    result = icp(experiment.source, experiment.target, experiment.T_init, parameters)
    if result.termination.failed:
        print(result.message)
        return 1
    distances = result.correspondences.distances
    print(f"truth       {pose_text(to_xytheta(experiment.T_target_source))}")
    print(f"guess       {pose_text(to_xytheta(experiment.T_init))}")
    print(f"estimate    {pose_text(to_xytheta(result.T_target_source))}")
    print(f"iterations  {result.iterations} ({result.message})")
    print(
        f"RMSE        {result.inlier_rmse:.4f} m over {result.inlier_count} inliers, "
        f"{np.sqrt(np.mean(distances**2)):.4f} m over all {len(distances)} points"
    )
    if args.plot or args.animate:  # else nobody waits for matplotlib
        from labkit.plotting import animate_icp, save_animation, save_figure  # noqa: PLC0415
    if args.plot:
        save_figure(_before_and_after(experiment, result), args.plot)
    if args.animate:
        save_animation(animate_icp(result), args.animate)
    return 0


def _check_pictures(args: argparse.Namespace) -> None:
    """Refuse a picture that cannot be written, before any work is done."""
    if args.plot or args.animate:  # else nobody waits for matplotlib
        from labkit.plotting.save import animation_suffix, figure_suffix  # noqa: PLC0415
    if args.plot:
        refuse_unwritable(args.plot)
        figure_suffix(args.plot)
    if args.animate:
        refuse_unwritable(args.animate)
        animation_suffix(args.animate)


def _before_and_after(experiment: LessonExperiment, result: IcpResult) -> Figure:
    from matplotlib.figure import Figure  # noqa: PLC0415

    from labkit.plotting import plot_scans  # noqa: PLC0415

    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    for ax, title, T in zip(
        figure.subplots(1, 2),
        ("at the guess", "at the estimate"),
        (experiment.T_init, result.T_target_source),
        strict=True,
    ):
        plot_scans(ax, experiment.source, experiment.target, T)
        ax.set_title(title)
    return figure
