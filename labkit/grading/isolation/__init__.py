"""Where students' code runs: modes of isolation by strength, each tried before it is used."""

from labkit.grading.isolation.modes import MODES, SAFE, available_modes, open_sandbox
from labkit.grading.isolation.process import SandboxError

__all__ = ["MODES", "SAFE", "SandboxError", "available_modes", "open_sandbox"]
