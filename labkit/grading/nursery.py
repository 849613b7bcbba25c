"""What workers are forked with: the process that `labkit.grading.pools` starts imports it."""

from __future__ import annotations

import gc

from labkit.grading import batch

__all__ = ["batch"]

gc.freeze()  # forks share these pages, and nobody need go through them again, at the end either
