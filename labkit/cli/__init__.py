"""The command line: ``labkit odometry``, ``match`` and others."""

from labkit.cli.main import main

__all__ = ["main"]
