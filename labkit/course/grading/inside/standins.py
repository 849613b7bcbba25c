"""Imports in the box: the scripts that were handed in, and stand-ins for what draws and shows.

A submission that plots, moves a slider or wraps a loop in a progress bar shall not fail for it:
`import matplotlib` gives a thing that takes every call and does nothing. labkit itself is one of
these, so that no answer can call the reference.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import sys
import types
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

NAMES = {
    "anywidget", "google", "IPython", "ipympl", "ipywidgets", "jupyterquiz", "labkit",
    "matplotlib", "mpl_toolkits", "nbgrader", "numba", "otter", "pandas", "PIL", "plotly",
    "pylab", "seaborn", "tqdm", "traitlets",
}  # fmt: skip


class StandIn:
    """Takes every call, attribute and index, and does nothing; it is false.

    A function handed to it comes back unchanged, so that a decorator of a missing package
    leaves what it decorates alone.
    """

    is_stand_in = True

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

    def __bool__(self) -> bool:
        return False

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


def vectorize(*arguments: Any, **_: Any) -> Any:
    """Vectorise in Python, as numba does in machine code; also called with its signatures."""
    return np.vectorize(arguments[0]) if callable(arguments[0]) else np.vectorize


WORKING = {
    "tqdm": progress, "trange": range, "prange": range, "vectorize": vectorize,
    "interact": lambda *_, **__: StandIn("interact"),
}  # fmt: skip


class StandInModule(types.ModuleType):
    """A module that has every name."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") and name.endswith("__"):
            raise AttributeError(name)
        return WORKING.get(name) or StandIn(f"{self.__name__}.{name}")


class Finder(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Imports the handed-in scripts from memory, and stand-ins; asked before all other finders.

    Parameters
    ----------
    scripts : mapping of str to str
        Source by file name. ``lab/mine.py`` is imported as ``mine`` and as ``lab.mine``.
    """

    def __init__(self, scripts: Mapping[str, str]) -> None:
        self.sources: dict[str, tuple[str, str]] = {}
        self.packages: set[str] = set()
        for file, text in scripts.items():
            parts = file.removesuffix(".txt").removesuffix(".py").replace("-", "_").split("/")
            is_package = parts[-1] == "__init__"
            for start in range(len(parts)):
                name = ".".join(parts[start:][:-1] if is_package else parts[start:])
                if name:
                    self.sources.setdefault(name, (file, text))
                    above = name if is_package else name.rpartition(".")[0]
                    while above:
                        self.packages.add(above)
                        above = above.rpartition(".")[0]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        """A spec for a script, for a folder of scripts, or for a stand-in."""
        known = fullname in self.sources or fullname in self.packages
        if fullname.partition(".")[0] in NAMES or (
            known and fullname not in sys.stdlib_module_names
        ):
            package = not known or fullname in self.packages
            return importlib.util.spec_from_loader(fullname, self, is_package=package)
        return None

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> types.ModuleType | None:
        """A stand-in for what is no script."""
        return StandInModule(spec.name) if spec.name.partition(".")[0] in NAMES else None

    def exec_module(self, module: types.ModuleType) -> None:
        """Run a script; a stand-in has nothing to run."""
        if not isinstance(module, StandInModule) and module.__name__ in self.sources:
            super().exec_module(module)

    def get_source(self, fullname: str) -> str:
        """The script's text."""
        return self.sources[fullname][1]

    def get_code(self, fullname: str) -> types.CodeType:
        """The script, compiled under the name of its file."""
        file, text = self.sources[fullname]
        return compile(text, file, "exec")

    def is_package(self, fullname: str) -> bool:
        """Whether other modules lie below it."""
        return fullname in self.packages


def forget_labkit() -> None:
    """Take the box's own modules out of reach of ``import``."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "labkit"]:
        del sys.modules[name]
