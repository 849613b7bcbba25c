"""Options are fields: their defaults, meanings and units come from one place."""

import argparse
import math
from dataclasses import replace

from labkit.cli.options import MATCHING, add_options, chosen, flag
from labkit.parameters import IcpParameters


def test_no_option_gives_the_defaults_and_each_can_be_set():
    defaults = IcpParameters(huber_delta=0.07)
    parser = argparse.ArgumentParser()
    add_options(parser, "all", defaults, MATCHING)
    assert parser.parse_args(["--gate", "OFF"]).max_correspondence_distance == math.inf
    assert replace(IcpParameters(), **chosen(parser.parse_args([]), MATCHING)) == defaults
    for name in MATCHING:
        value = "point_to_line" if name == "metric" else 0.5
        args = parser.parse_args([flag(name), str(value)])
        assert chosen(args, MATCHING) == chosen(parser.parse_args([]), MATCHING) | {name: value}
