"""What a case is, and where cases and their files are collected.

`Cases` collects them. A table is a list of rows of floats, a parameter file a dict; both
stand under the path that the command names, relative to the folder of ``vectors.json``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

Parameters = dict[str, float | None]
Content = list[list[float]] | Parameters


@dataclass(frozen=True, kw_only=True)
class Case:
    """One command; its name is unique."""

    name: str
    group: str
    command: list[str]


@dataclass(frozen=True)
class Cases:
    """All cases and the files that their commands name."""

    cases: list[Case] = field(default_factory=list)
    files: dict[str, Content] = field(default_factory=dict)

    def table(self, name: str, rows: Any, decimals: int = 6) -> str:
        """Keep `rows` as ``data/name.csv``; rounded, so that no libm decides a digit."""
        rounded = np.round(np.asarray(rows, dtype=np.float64), decimals) + 0.0  # no -0.0
        return self._keep(f"data/{name}.csv", rounded.tolist())

    def align(self, name: str, p: Any, q: Any, w: Any = None, decimals: int = 6) -> None:
        columns = (p, q) if w is None else (p, q, w)
        self._case(name, "alignment", "align", self.table(name, np.column_stack(columns), decimals))

    def match(self, group: str, name: str, target: str, source: str, **parameters: Any) -> None:
        """`name` also names the file of parameters."""
        file = self._keep(f"data/{name}.json", parameters)
        self._case(name, group, "match", target, source, file)

    def integrate(self, name: str, increments: Any, start: tuple[float, float, float]) -> None:
        file = self.table(name, increments, decimals=16)
        self._case(name, "integration", "integrate", file, *map(repr, start))

    def _keep(self, path: str, content: Content) -> str:
        if self.files.setdefault(path, content) != content:
            raise ValueError(f"two different files are named {path}")
        return path

    def _case(self, name: str, group: str, *command: str) -> None:
        if any(case.name == name for case in self.cases):
            raise ValueError(f"two cases are named {name}")
        self.cases.append(Case(name=name, group=group, command=list(command)))
