"""Options are fields: their defaults, meanings and units come from one place."""

import argparse
from dataclasses import replace

from labkit.cli.options import MATCHING, add_options, chosen, flag
from labkit.filters import Preprocessing
from labkit.parameters import IcpParameters


def parser_of(defaults, names):
    parser = argparse.ArgumentParser(
        formatter_class=lambda prog: argparse.HelpFormatter(prog, width=1000)
    )
    add_options(parser, "all", defaults, names)
    return parser


def test_no_option_gives_the_defaults_and_each_can_be_set():
    defaults = IcpParameters(huber_delta=0.07)
    parser = parser_of(defaults, MATCHING)
    assert replace(IcpParameters(), **chosen(parser.parse_args([]), MATCHING)) == defaults
    for name in MATCHING:
        value = "point_to_line" if name == "metric" else 0.5
        args = parser.parse_args([flag(name), str(value)])
        assert chosen(args, MATCHING) == chosen(parser.parse_args([]), MATCHING) | {name: value}


def test_the_help_tells_meaning_unit_and_default_and_off_is_infinity():
    parser = parser_of(Preprocessing(range_max=5.0), ("range_max",))
    assert parser.parse_args(["--range-max", "OFF"]).range_max == float("inf")
    told = parser_of(Preprocessing(), ("range_max",)).format_help()
    assert "drop points farther than this; inf turns it off [m] (default inf)" in told
    assert "--range-min" not in told
