"""What a bug report needs: the versions of labkit, of Python, and of the packages below."""

from __future__ import annotations

import argparse
import platform
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

from labkit import __version__


class ShowVersions(argparse.Action):
    """The option that prints the versions and ends; they are looked up only then."""

    def __init__(self, option_strings: list[str], dest: str) -> None:
        super().__init__(
            option_strings,
            dest,
            nargs=0,
            default=argparse.SUPPRESS,
            help="show the versions of labkit, Python, numpy, scipy and numba, and exit",
        )

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        """Print the line, and end with status 0."""
        print(describe_versions())
        parser.exit()


def describe_versions() -> str:
    """All versions on one line; no package is imported to learn its own."""
    parts = [f"Python {platform.python_version()}", _described("numpy"), _described("scipy")]
    parts.append(_described("numba") if find_spec("numba") else "without numba")
    return f"labkit {__version__} ({', '.join(parts)})"


def _described(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:  # not installed by pip or the like, but copied
        return f"{package} of unknown version"
