"""``labkit demo``: the lesson's experiment, whose truth is known."""

from __future__ import annotations

import argparse

from labkit.cli.match import result_text
from labkit.cli.options import MATCHING, add_options, chosen
from labkit.cli.text import pose_text
from labkit.icp import icp
from labkit.parameters import IcpParameters
from labkit.se2 import to_xytheta
from labkit.simulation import lesson_experiment

HELP = "match the lesson's two simulated scans and compare with the truth"
DESCRIPTION = """\
Match two simulated scans of an L-shaped corner with scattered points: 600 world points,
1 cm of noise, spurious returns, a guess that is 3 degrees and 18 cm off. Change a
parameter and watch the estimate follow: `labkit demo --gate off --overlap 1`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    add_options(parser, "matching", IcpParameters(), MATCHING)


def run(args: argparse.Namespace) -> int:
    """Run the experiment and print its result."""
    experiment = lesson_experiment()
    parameters = IcpParameters(**chosen(args, MATCHING))
    result = icp(experiment.source, experiment.target, experiment.T_init, parameters)
    print(f"truth: {pose_text(to_xytheta(experiment.T_target_source))}")
    print(f"guess: {pose_text(to_xytheta(experiment.T_init))}")
    print(f"estimate: {result_text(result)}")
    return 1 if result.termination.failed else 0
