"""Options and fields stay one thing: every field has an option, and defaults pass through."""

import argparse
import math
from dataclasses import fields

import pytest

from labkit.cli.options import EXPLANATIONS, add_options, from_options, number_or_off
from labkit.filters import Preprocessing
from labkit.odometry import OdometryParameters, SanityLimits
from labkit.registration import IcpParameters

OBJECTS = (IcpParameters(), SanityLimits(), Preprocessing())


@pytest.mark.parametrize("defaults", OBJECTS, ids=lambda item: type(item).__name__)
def test_no_option_gives_the_defaults(defaults):
    parser = argparse.ArgumentParser()
    add_options(parser, "all", defaults)
    assert from_options(type(defaults), parser.parse_args([])) == defaults


@pytest.mark.parametrize("defaults", OBJECTS, ids=lambda item: type(item).__name__)
def test_every_number_can_be_set(defaults):
    parser = argparse.ArgumentParser()
    add_options(parser, "all", defaults)
    for field in fields(defaults):
        default = getattr(defaults, field.name)
        if isinstance(default, float | int) and not isinstance(default, bool):
            value = 1 if isinstance(default, int) else 0.5
            args = parser.parse_args([f"--{field.name.replace('_', '-')}", str(value)])
            assert getattr(from_options(type(defaults), args), field.name) == value


@pytest.mark.parametrize("default", [True, False])
def test_a_switch_goes_on_and_off(default):
    parser = argparse.ArgumentParser()
    add_options(parser, "all", IcpParameters(approach=default))
    for flags, value in (([], default), (["--approach"], True), (["--no-approach"], False)):
        assert from_options(IcpParameters, parser.parse_args(flags)).approach is value
    assert f"(default {'on' if default else 'off'})" in parser.format_help()


def test_every_explanation_belongs_to_a_field():
    kinds = (IcpParameters, SanityLimits, Preprocessing, OdometryParameters)
    assert set(EXPLANATIONS) <= {field.name for kind in kinds for field in fields(kind)}


def test_off_is_infinity():
    assert number_or_off("OFF") == math.inf
    assert number_or_off("0.5") == 0.5
