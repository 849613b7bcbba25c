"""The command line: ``labkit demo``, ``odometry``, ``match`` and ``evaluate``."""

from labkit.cli.main import main

__all__ = ["main"]
