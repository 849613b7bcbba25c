"""Stand-ins for plots, widgets and other packages that grading does without.

A submission that draws, shows a slider or wraps a loop in a progress bar shall not fail
for it: such imports give a thing that takes every call and does nothing.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import sys
import types
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

NAMES = {
    "anywidget", "google", "IPython", "ipympl", "ipywidgets", "jupyterquiz", "labkit",
    "matplotlib", "mpl_toolkits", "nbgrader", "numba", "otter", "pandas", "PIL", "plotly",
    "pylab", "seaborn", "tqdm", "traitlets",
}  # fmt: skip


class StandIn:
    """Takes every call, attribute and index, and does nothing.

    A function handed to it comes back unchanged, so that a decorator of a missing package
    leaves what it decorates alone.
    """

    def __init__(self, name: str) -> None:
        self.__name__ = name

    def __getattr__(self, name: str) -> StandIn:
        if name.startswith("__") and name.endswith("__"):
            raise AttributeError(name)
        return StandIn(f"{self.__name__}.{name}")

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "__name__":
            object.__setattr__(self, name, value)

    def __call__(self, *arguments: Any, **keywords: Any) -> Any:
        """Do nothing."""
        if arguments and isinstance(arguments[0], types.FunctionType):
            return arguments[0]
        if self.__name__.endswith(".subplots"):
            return self, axes(self, *arguments, **keywords)
        return StandIn(self.__name__)

    def __mro_entries__(self, bases: tuple[Any, ...]) -> tuple[type, ...]:
        return ()

    def __iter__(self) -> Iterator[StandIn]:
        return iter((self,))  # line, = ax.plot(...)

    def __enter__(self) -> StandIn:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def __getitem__(self, _: Any) -> StandIn:
        return self

    def __setitem__(self, _: Any, value: Any) -> None:
        return None

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError(f"{self.__name__} is not available while grading: it gives no numbers")

    def _operation(self, *_: Any) -> StandIn:
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __or__ = _operation


def axes(figure: StandIn, nrows: int = 1, ncols: int = 1, **_: Any) -> Any:
    """What ``plt.subplots(nrows, ncols)`` returns beside the figure."""
    if nrows == ncols == 1:
        return figure
    grid = np.empty((nrows, ncols), dtype=object)
    grid.fill(figure)
    return grid.ravel() if 1 in (nrows, ncols) else grid


def progress(iterable: Any = None, *_: Any, **__: Any) -> Any:
    """Give what is iterated over, as tqdm does, without a bar."""
    return StandIn("tqdm") if iterable is None else iterable


class _StandInModule(types.ModuleType):
    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") and name.endswith("__"):
            raise AttributeError(name)
        if self.__name__.split(".")[0] == "tqdm" and name in ("tqdm", "trange"):
            return progress if name == "tqdm" else range
        return StandIn(f"{self.__name__}.{name}")


class StandIns(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds the packages of `NAMES` and all below them; the last finder to be asked."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        """A spec for a stand-in, or None for a name that has none."""
        if fullname.split(".", maxsplit=1)[0] not in NAMES:
            return None
        return importlib.machinery.ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> types.ModuleType:
        """An empty module that has every name."""
        return _StandInModule(spec.name)

    def exec_module(self, module: types.ModuleType) -> None:
        """Nothing to run."""


def forget_labkit() -> None:
    """Take the box's own modules, and what may have found them, out of reach of ``import``."""
    for loaded in list(sys.modules):
        if "labkit" in loaded:
            del sys.modules[loaded]
