"""Packages beyond labkit's own requirements, and the message if one is missing."""

from __future__ import annotations

import importlib
from typing import Any

from labkit.support.errors import LabkitError

DISTRIBUTION = "icp-course-lab"  # the name by which pip knows labkit


class MissingExtraError(LabkitError, ImportError):
    """A package that one of labkit's extras brings is not installed."""

    def __init__(self, purpose: str, package: str, extra: str) -> None:
        super().__init__(
            f"{purpose} needs {package}, which is not installed: "
            f'python -m pip install "{DISTRIBUTION}[{extra}]"'
        )


def need(module: str, *, purpose: str, extra: str) -> Any:
    """Import a module that an extra of labkit brings; the message begins with the purpose."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        missing = (error.name or module).partition(".")[0]
        raise MissingExtraError(purpose, missing, extra) from error
