"""Imports in the box: the scripts that were handed in, and stand-ins for what is not there.

labkit is a stand-in, so that no answer can call the reference, and so is what needs a kernel or a
server. All other packages are the installed ones.
"""

from __future__ import annotations

import importlib.abc
import sys
import types
from collections.abc import Callable
from importlib.machinery import ModuleSpec, PathFinder
from typing import Any

STANDING_IN = {"google", "jupyterquiz", "labkit", "nbgrader", "otter"}


class StandIn(types.ModuleType):
    """A package, or a thing in it: takes every call, attribute and index, and does nothing.

    It is no number: each way to calculate with it raises `TypeError`, which names the package.
    """

    is_stand_in = True

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return StandIn(f"{self.__name__}.{name}")

    def __call__(self, argument: Any = None, *_: Any, **__: Any) -> Any:
        """Do nothing; a function comes back as it was, so that decorators leave it alone.

        `check` is called with a function, and decorates none.
        """
        is_check = self.__name__.endswith(".check")
        is_decorated = isinstance(argument, types.FunctionType) and not is_check
        return argument if is_decorated else self

    def __mro_entries__(self, _: object) -> tuple[type, ...]:
        return ()  # a class may be derived from it

    def __bool__(self) -> bool:
        return False

    def __exit__(self, *_: Any) -> None: ...

    def _fail(self, *_: Any) -> Any:
        package = self.__name__.partition(".")[0]
        raise TypeError(f"{package} is not available while grading: it gives no numbers")

    __enter__ = __getitem__ = __call__
    __setitem__ = __exit__
    __array__ = __float__ = __iter__ = __len__ = __neg__ = _fail
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _fail
    __matmul__ = __rmatmul__ = __truediv__ = __rtruediv__ = _fail
    __lt__ = __le__ = __gt__ = __ge__ = _fail


class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports handed-in scripts, from whatever folder, and stand-ins.

    It is asked before all others. A notebook counts as a script, and a folder as a package, where
    no package of that name is installed.
    """

    def __init__(self, run: Callable[[str, str, types.ModuleType], None]) -> None:
        self.run = run  # a script, by its source and name
        self.scripts: dict[str, str] = {}  # sources by file name

    def find_spec(self, name: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """A spec for a script, a folder of scripts or a stand-in."""
        place = f"/{name.replace('.', '/')}"
        folder = any(f"{place}/" in f"/{file}" for file in self.scripts)
        script = self.find_script(f"{place}.py", f"{place}.py.txt", f"{place}/__init__.py")
        file = script or self.find_script(f"{place}.ipynb")
        is_found = bool(script or ((file or folder) and not PathFinder.find_spec(name, path)))
        is_own = is_found and name not in sys.stdlib_module_names
        if is_own or name.partition(".")[0] in STANDING_IN:
            return ModuleSpec(name, self, origin=file or None, is_package=folder or not file)
        return find_matplotlib() if name == "matplotlib" else None

    def find_script(self, *paths: str) -> str:
        """The name of a file whose path ends with one of these; "" where there is none."""
        return next((file for file in self.scripts if f"/{file}".endswith(paths)), "")

    def create_module(self, spec: ModuleSpec) -> types.ModuleType | None:
        """A stand-in, or for a script a module as any other."""
        return None if spec.origin else StandIn(spec.name)

    def exec_module(self, module: types.ModuleType) -> None:
        """Run a script; a stand-in has nothing to run."""
        file = module.__spec__ and module.__spec__.origin
        if file:
            self.run(self.scripts[file], file, module)


def find_matplotlib() -> ModuleSpec | None:
    """The spec of matplotlib, whose `use` then does nothing: a box has no screen of any kind."""
    spec = PathFinder.find_spec("matplotlib")
    if spec and spec.loader:
        load = spec.loader.exec_module

        def load_without_screen(module: Any) -> None:
            load(module)
            module.use = lambda *_, **__: None

        spec.loader.exec_module = load_without_screen  # type: ignore[method-assign]
    return spec
