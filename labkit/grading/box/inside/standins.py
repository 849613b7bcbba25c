"""Imports in the box: the scripts that were handed in, and stand-ins for what is not there.

A submission that moves a slider or draws shall not fail for it. labkit itself is a stand-in, so
that no answer can call the reference, and so is what speaks to a notebook. Packages that compute or
draw are the installed ones where a box may use them, and stand-ins elsewhere.
"""

from __future__ import annotations

import importlib.abc
import sys
import types
from collections.abc import Callable, Iterable, Iterator
from importlib.machinery import ModuleSpec
from typing import Any

IN_NOTEBOOKS = {
    "anywidget", "google", "IPython", "ipympl", "ipywidgets", "jupyterquiz", "labkit", "nbgrader",
    "otter", "traitlets",
}  # fmt: skip
INSTALLED = {
    "matplotlib", "mpl_toolkits", "numba", "pandas", "PIL", "plotly", "pylab", "seaborn", "tqdm",
}  # fmt: skip


class StandIn(types.ModuleType):
    """A package, or a thing in it: takes every call, attribute and index, and does nothing."""

    is_stand_in = True

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return WORKING[name] if name in WORKING else StandIn(f"{self.__name__}.{name}")

    def __call__(self, argument: Any = None, *_: Any, **__: Any) -> Any:
        """Do nothing; a function comes back as it was, so that decorators leave it alone."""
        return argument if isinstance(argument, types.FunctionType) else self

    def __iter__(self) -> Iterator[StandIn]:
        return iter((self,))  # line, = ax.plot(...)

    def __bool__(self) -> bool:
        return False

    def __exit__(self, *_: Any) -> None: ...

    def __array__(self, *_: Any, **__: Any) -> Any:
        package = self.__name__.partition(".")[0]
        raise TypeError(f"{package} is not available while grading: it gives no numbers")

    def __format__(self, _: str) -> str:
        return ""

    __float__ = __int__ = __index__ = __len__ = __array__
    __lt__ = __le__ = __gt__ = __ge__ = __neg__ = __pos__ = __abs__ = __invert__ = __array__
    __truediv__ = __rtruediv__ = __floordiv__ = __rfloordiv__ = __mod__ = __rmod__ = __array__
    __pow__ = __rpow__ = __matmul__ = __rmatmul__ = __and__ = __rand__ = __xor__ = __array__
    __rxor__ = __lshift__ = __rlshift__ = __rshift__ = __rrshift__ = __ror__ = __array__
    __round__ = __fspath__ = __array__
    __enter__ = __getitem__ = __call__
    __setitem__ = __exit__
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __or__ = __call__


class Absent:
    """A name from a package that is not installed: its use raises what its import raised."""

    def __init__(self, error: ModuleNotFoundError) -> None:
        self.error = error

    def __getattr__(self, name: str) -> Any:
        raise self.error

    def __call__(self, *_: Any, **__: Any) -> Any:
        """Raise what the import raised."""
        raise self.error


def absent(names: Iterable[str], error: ModuleNotFoundError) -> dict[str, Absent]:
    """Placeholders for the names that a failed import would have bound."""
    return dict.fromkeys(names, Absent(error))


class Bar(StandIn):
    """A bar of tqdm: it goes through what it was given."""

    def __init__(self, over: Any) -> None:
        super().__init__("tqdm")
        self.over = over

    def __iter__(self) -> Iterator[Any]:
        return iter(self.over)

    def __len__(self) -> int:
        return len(self.over)


class Bars(StandIn):
    """``tqdm``: it is called, and has functions such as `write`."""

    def __call__(self, argument: Any = None, *_: Any, **named: Any) -> Any:
        """A bar around an iterable."""
        iterable = named.get("iterable", argument)
        return StandIn("tqdm") if iterable is None else Bar(iterable)


def _limits(*_: Any, **__: Any) -> tuple[float, float]:
    return 0.0, 1.0


WORKING = {
    "check": lambda *_: StandIn("check"),  # and not the function
    "subplots": lambda *_, **__: (StandIn("figure"), StandIn("axes")),
    "hist": lambda *_, **__: (StandIn("counts"), StandIn("edges"), StandIn("patches")),
    **dict.fromkeys(("xlim", "ylim", "get_xlim", "get_ylim"), _limits),
    "tqdm": Bars("tqdm"),
    "trange": lambda *limits, **_: Bar(range(*limits)),
    "prange": range,
}


class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports handed-in scripts, from whatever folder, and stand-ins.

    It is asked before all others, and a last one after them for what they did not find. There a
    notebook counts as a script, and a folder as a package, so neither hides an installed one.
    """

    def __init__(
        self, run: Callable[[str, str, types.ModuleType], None], *, is_last: bool = False
    ) -> None:
        self.run = run  # a script, by its source and name
        self.is_last = is_last
        self.scripts: dict[str, str] = {}  # sources by file name
        self.standing_in = INSTALLED if is_last else IN_NOTEBOOKS | INSTALLED

    def install(self, *, with_packages: bool) -> None:
        """Be asked for imports from now on; `with_packages` installed ones come first."""
        if with_packages:
            self.standing_in = IN_NOTEBOOKS
        last = Finder(self.run, is_last=True)
        last.scripts = self.scripts
        sys.meta_path[:] = [self, *sys.meta_path, last]

    def find_spec(self, name: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """A spec for a script, a folder of scripts or a stand-in."""
        place = name.replace(".", "/")
        endings = (".ipynb",) if self.is_last else (".py", ".py.txt", "/__init__.py")
        paths = tuple(f"/{place}{ending}" for ending in endings)
        file = next((file for file in self.scripts if f"/{file}".endswith(paths)), "")
        folder = any(f"/{place}/" in f"/{file}" for file in self.scripts)
        is_found = bool(file) or (folder and self.is_last)
        is_own = is_found and name not in sys.stdlib_module_names
        if is_own or name.partition(".")[0] in self.standing_in:
            return ModuleSpec(name, self, origin=file or None, is_package=folder or not file)
        return None

    def create_module(self, spec: ModuleSpec) -> types.ModuleType | None:
        """A stand-in, or for a script a module as any other."""
        return None if spec.origin else StandIn(spec.name)

    def exec_module(self, module: types.ModuleType) -> None:
        """Run a script; a stand-in has nothing to run."""
        file = module.__spec__ and module.__spec__.origin
        if file:
            self.run(self.scripts[file], file, module)
