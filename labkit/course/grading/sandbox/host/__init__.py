"""Where students' code runs: modes of isolation by strength, each tried before it is used."""

from labkit.course.grading.sandbox.host.box import SandboxError
from labkit.course.grading.sandbox.host.modes import (
    MODES,
    SAFE,
    Sandbox,
    available_modes,
    open_sandbox,
)

__all__ = ["MODES", "SAFE", "Sandbox", "SandboxError", "available_modes", "open_sandbox"]
