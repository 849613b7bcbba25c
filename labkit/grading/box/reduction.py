"""What is left of a cell that hangs or crashes: its definitions, which others may need."""

from __future__ import annotations

import ast

DEFINITIONS = (
    ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Import, ast.ImportFrom,
)  # fmt: skip


def definitions(source: str) -> str:
    r"""Keep imports, functions, classes and assignments that call nothing.

    Examples
    --------
    >>> print(definitions("k = 2\ndef f(x):\n    return k * x\nwhile True: f(1)"))
    k = 2
    <BLANKLINE>
    def f(x):
        return k * x
    """
    tree = ast.parse(source)
    kept = [node for node in tree.body if isinstance(node, DEFINITIONS) or _is_constant(node)]
    return ast.unparse(ast.Module(kept, []))


def _is_constant(node: ast.stmt) -> bool:
    if not isinstance(node, (ast.Assign, ast.AnnAssign)):
        return False
    quiet = (ast.Call, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp, ast.Await)
    return not any(isinstance(part, quiet) for part in ast.walk(node))
