"""The standard library, carried in memory: a jailed process sees no file to import from.

Compiled modules (numpy, those of Python itself) are imported before any jail is closed;
sources of the rest are kept as text and compiled when a submission asks for them. scipy,
which takes three times as long as all the others, is imported before the first submission
that names it; to one that does not name it, it does not exist.

For plots, widgets and other packages that grading does without there are stand-ins. A
submission that draws, shows a slider or wraps a loop in a progress bar shall not fail for it:
such imports give a thing that takes every call and does nothing.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import io
import sys
import sysconfig
import types
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

# Imported once, before a submission needs it; a package that is missing is left out.
SCIPY = (
    "scipy", "scipy.linalg", "scipy.optimize", "scipy.sparse", "scipy.sparse.linalg",
    "scipy.spatial", "scipy.spatial.distance", "scipy.spatial.transform", "scipy.special",
)  # fmt: skip
EAGER = (
    "numpy", "numpy.fft", "numpy.linalg", "numpy.ma", "numpy.matlib", "numpy.polynomial",
    "numpy.random", "numpy.testing", "numpy.typing",
    "abc", "bisect", "cmath", "collections", "contextlib", "copy", "dataclasses", "datetime",
    "decimal", "doctest", "enum", "fractions", "functools", "heapq", "inspect", "io",
    "itertools", "json", "math", "operator", "os", "pathlib", "pprint", "queue", "random",
    "re", "statistics", "string", "sys", "tempfile", "textwrap", "threading", "time",
    "timeit", "traceback", "typing", "unittest", "warnings", "encodings.idna",
)  # fmt: skip
UNWANTED = {
    "site-packages", "dist-packages", "test", "tests", "idlelib", "lib2to3", "ensurepip",
    "tkinter", "turtledemo", "pydoc_data", "lib-dynload", "__pycache__",
}  # fmt: skip
UNWANTED_COMPILED = (
    "_asyncio", "_test", "_xx", "xx", "_ctypes_test", "_codecs_", "_crypt", "_curses", "_dbm",
    "_gdbm", "_multiprocessing", "_posix", "_sqlite3", "_ssl", "_tkinter", "audioop", "nis",
    "ossaudio", "readline", "resource_", "spwd", "syslog",
)  # fmt: skip


class Source(NamedTuple):
    """A module's text, the file that it came from, and whether it is a package."""

    text: bytes
    file: str
    package: bool


class Library(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Imports pure Python modules from memory."""

    def __init__(self, sources: dict[str, Source]) -> None:
        self.sources = sources

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        """A spec for a module that is carried, or None."""
        source = self.sources.get(fullname)
        if source is None:
            return None
        spec = importlib.machinery.ModuleSpec(
            fullname, self, origin=source.file, is_package=source.package
        )
        spec.has_location = True  # so that it has a `__file__`
        return spec

    def get_source(self, fullname: str) -> str:
        """The module's text."""
        return importlib.util.decode_source(self.sources[fullname].text)

    def get_code(self, fullname: str) -> types.CodeType:
        """The module, compiled."""
        return self.source_to_code(self.sources[fullname].text, self.sources[fullname].file)

    def is_package(self, fullname: str) -> bool:
        """Whether the module has modules below it."""
        return self.sources[fullname].package

    def carry(self, text: str, file: str, names: Sequence[str]) -> None:
        """Take a script in by several names, instead of any other module that has one of them."""
        for name in names:
            sys.modules.pop(name, None)
            package = file.endswith("__init__.py")
            self.sources[name] = Source(text.encode("utf-8", "replace"), file, package)
            above = name.rpartition(".")[0]
            while above and above not in sys.modules:
                self.sources.setdefault(above, Source(b"", file, True))
                above = above.rpartition(".")[0]


class Shelf:
    """What this process has imported for submissions; nothing else can be imported in a jail."""

    def __init__(self) -> None:
        """Import all but scipy, and cut all other ways to import."""
        leave_out_f2py()
        self.ways = sys.meta_path[:], sys.path[:], sys.path_hooks[:]
        self._take((*EAGER, *compiled_modules()))
        self.sources = dict(pure_modules(Path(sysconfig.get_path("stdlib"))))
        self._cut()

    def add_scipy(self) -> None:
        """Import scipy, too."""
        sys.meta_path[:], sys.path[:], sys.path_hooks[:] = self.ways
        self._take(SCIPY)
        self._cut()

    @staticmethod
    def hide_scipy() -> None:
        """Have no scipy in this process any more."""
        for name in [name for name in sys.modules if name.partition(".")[0] == "scipy"]:
            del sys.modules[name]

    def _take(self, names: Sequence[str]) -> None:
        gc.disable()  # nothing that an import makes goes away
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            for name in names:
                with contextlib.suppress(Exception):
                    importlib.import_module(name)

    def _cut(self) -> None:
        sys.meta_path[:] = [
            importlib.machinery.BuiltinImporter,
            importlib.machinery.FrozenImporter,
            Library(self.sources),
            StandIns(),
        ]
        sys.path[:] = []
        sys.path_hooks[:] = []
        sys.path_importer_cache.clear()
        forget_labkit()
        gc.freeze()  # later forks share these pages for good
        gc.enable()


def leave_out_f2py() -> None:
    """Put nothing in the place of numpy's compiler, which `from numpy import *` would import.

    There is no compiler to call in a jail, and it takes as long as a tenth of all the rest.
    """
    with contextlib.suppress(ImportError):
        numpy: Any = importlib.import_module("numpy")
        numpy.f2py = sys.modules["numpy.f2py"] = types.ModuleType("numpy.f2py")


def compiled_modules() -> Iterator[str]:
    """The names of the standard library's extension modules."""
    for folder in sys.path:
        if folder.endswith("lib-dynload"):
            names = {path.name.split(".")[0] for path in Path(folder).iterdir()}
            yield from sorted(name for name in names if not name.startswith(UNWANTED_COMPILED))


def pure_modules(folder: Path, prefix: str = "") -> Iterator[tuple[str, Source]]:
    """The sources below a folder by their module's name."""
    for path in folder.iterdir():
        if path.name in UNWANTED or "-" in path.name:
            continue
        if path.suffix == ".py":
            package = path.stem == "__init__"
            name = prefix[:-1] if package else prefix + path.stem
            if name and path.exists():  # a link may lead out of the box
                yield name, Source(path.read_bytes(), str(path), package)
        elif (path / "__init__.py").exists():
            yield from pure_modules(path, f"{prefix}{path.name}.")


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
