"""What workers are forked with: the process that `workers.py` starts imports it."""

from __future__ import annotations

import gc

from labkit.grading.class_run import run

__all__ = ["run"]

gc.freeze()  # forks share these pages, and nobody need go through them again, at the end either
