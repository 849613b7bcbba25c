"""``labkit demo``: the lesson's experiment, whose truth is known."""

from __future__ import annotations

import argparse

from labkit.cli.text import pose_text
from labkit.icp import icp
from labkit.simulation import lesson_experiment

HELP = "match the lesson's two simulated scans and compare with the truth"
DESCRIPTION = """\
Match two simulated scans of an L-shaped corner with scattered points: 600 world points,
1 cm of noise, spurious returns, a guess that is 3 degrees and 18 cm off."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add nothing: the experiment is the lesson's."""


def run(args: argparse.Namespace) -> int:
    """Run the experiment and print its result."""
    experiment = lesson_experiment()
    result = icp(experiment.source, experiment.target, experiment.T_init)
    print(f"truth       {pose_text(experiment.T_target_source)}")
    print(f"guess       {pose_text(experiment.T_init)}")
    print(f"estimate    {pose_text(result.T_target_source)}")
    print(f"iterations  {result.iterations} ({result.message})")
    print(f"RMSE        {result.inlier_rmse:.4f} m over {result.inlier_count} inliers")
    return 0
