"""Options and fields stay one thing: every field has an option, and defaults pass through."""

import argparse
import math
from dataclasses import fields, replace

import pytest

from labkit.cli.options import add_options, from_options, number_or_off
from labkit.errors import InvalidParameterError
from labkit.filters import Preprocessing
from labkit.odometry import OdometryParameters, SanityLimits
from labkit.parameters import IcpParameters


class OneLine(argparse.HelpFormatter):
    """Breaks no lines."""

    def __init__(self, prog):
        super().__init__(prog, width=1000)


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


@pytest.mark.parametrize("defaults", OBJECTS, ids=lambda item: type(item).__name__)
def test_every_option_says_what_it_means_and_in_which_unit(defaults):
    parser = argparse.ArgumentParser(formatter_class=OneLine)
    add_options(parser, "all", defaults)
    told = parser.format_help()
    for field in fields(defaults):
        unit = f" [{field.metadata['unit']}]" if "unit" in field.metadata else ""
        assert f"{field.metadata['help']}{unit} (default " in told


@pytest.mark.parametrize("defaults", OBJECTS, ids=lambda item: type(item).__name__)
def test_the_unit_of_a_field_is_that_of_its_check(defaults):
    for field in fields(defaults):
        if field.type == "float":
            unit = f" {field.metadata['unit']}" if "unit" in field.metadata else ""
            with pytest.raises(InvalidParameterError, match=rf"[])]{unit}, got nan$") as raised:
                replace(defaults, **{field.name: math.nan})
            assert raised.value.parameter == field.name


def test_only_the_fields_that_are_named_get_options():
    parser = argparse.ArgumentParser()
    add_options(parser, "some", OdometryParameters(), names=("against", "on_skip"))
    args = parser.parse_args(["--on-skip", "stand"])
    assert vars(args) == {"against": "map", "on_skip": "stand"}


def test_off_is_infinity():
    assert number_or_off("OFF") == math.inf
    assert number_or_off("0.5") == 0.5
