"""``labkit demo``: the lesson's experiment, whose truth is known."""

from __future__ import annotations

import argparse
import math

from labkit.icp import icp
from labkit.se2 import to_xytheta
from labkit.simulation import lesson_experiment
from labkit.support.arrays import FloatArray
from labkit.support.interrupts import loading

DESCRIPTION = """\
Match two simulated scans of an L-shaped corner with scattered points: 600 world points,
1 cm of noise, spurious returns, a guess that is 3 degrees and 18 cm off."""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``demo`` to the command line."""
    about = "match the lesson's two simulated scans and compare with the truth"
    commands.add_parser("demo", help=about, description=DESCRIPTION).set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the experiment and print its result."""
    experiment = lesson_experiment()
    with loading():  # it compiles
        result = icp(experiment.source, experiment.target, experiment.T_init)
    print(f"truth       {pose_text(experiment.T_target_source)}")
    print(f"guess       {pose_text(experiment.T_init)}")
    print(f"estimate    {pose_text(result.T_target_source)}")
    print(f"iterations  {result.iterations} ({result.message})")
    print(f"RMSE        {result.inlier_rmse:.4f} m over {result.inlier_count} inliers")
    return 0


def pose_text(T: FloatArray) -> str:
    """Format a transform on one line."""
    x, y, theta = to_xytheta(T)
    return f"t = ({x:.4f}, {y:.4f}) m, theta = {math.degrees(theta):.3f} deg"
