"""What a report needs beyond labkit's own dependencies, and its error."""

from __future__ import annotations

import importlib
from typing import Any

from labkit.errors import LabkitError


class ReportError(LabkitError):
    """A report that cannot be made; the message says why and what to do."""


def need(name: str) -> Any:
    """Import a module that only reports need, or say how to get it."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ReportError(
            f"a report needs more than labkit does: "
            f"`python -m pip install 'labkit[report]'` ({error})"
        ) from error
