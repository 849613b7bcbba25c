"""Which matchers there are: the lab's own, and the peers that are installed."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from data import Pair
from labkit import Scan
from labkit.support.arrays import FloatArray

Answer = tuple[FloatArray, int | None]

MODULES = (  # module of adapters, the package that it needs
    ("matchers.lab", "labkit"),
    ("matchers.lesson", "scipy"),
    ("matchers.open3d_icp", "open3d"),
    ("matchers.small_gicp_icp", "small_gicp"),
    ("matchers.kiss", "kiss-icp"),
    ("matchers.fricp", "fricp-cpp"),
    ("matchers.simple", "simpleicp"),
    ("matchers.karto", "karto-scanmatcher"),
    ("matchers.mrpt", "libmrpt-slam-dev (Debian)"),
)


SLOW_PAIRS = 10  # enough to see that a matcher takes a second a pair


@dataclass(frozen=True, kw_only=True)
class Matcher:
    """A way to match two scans; `function` is an adapter of `matchers`."""

    name: str
    function: Callable[..., Answer]
    takes_scans: bool
    slow: bool
    can_match: Callable[[Scan], bool]

    def share(self, pairs: Sequence[Pair]) -> Sequence[Pair]:
        """The pairs that it is tried on: those that it can match, or a few if it is slow."""
        if not self.can_match(pairs[0].source):
            return ()
        return pairs[:SLOW_PAIRS] if self.slow else pairs

    def arguments(self, pair: Pair, gate: float) -> tuple[object, ...]:
        """What `function` is called with: scans for those that know beams, points for the rest."""
        pair = pair.fresh()
        if self.takes_scans:
            return pair.source, pair.target, pair.T_init, gate
        return pair.source.points, pair.target.points, pair.T_init, gate


def load_matchers() -> tuple[list[Matcher], dict[str, str]]:
    """The matchers that can run here, and why the rest cannot, by package."""
    found, missing = [], {}
    for module, package in MODULES:
        try:
            adapters = importlib.import_module(module)
        except (ImportError, OSError) as error:  # OSError: a shared library is not there
            missing[package] = str(error)
            continue
        found += [
            Matcher(
                name=name,
                function=function,
                takes_scans=getattr(adapters, "TAKES_SCANS", False),
                slow=getattr(adapters, "SLOW", False),
                can_match=getattr(adapters, "can_match", _always),
            )
            for name, function in adapters.MATCHERS.items()
        ]
    return found, missing


def _always(scan: Scan) -> bool:
    """Most match any scan."""
    del scan
    return True
