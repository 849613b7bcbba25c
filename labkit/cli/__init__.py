"""The command line: ``labkit odometry``, ``grade`` and others."""

from labkit.cli.main import main

__all__ = ["main"]
