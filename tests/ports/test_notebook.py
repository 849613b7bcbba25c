"""The Wolfram notebook is a `Notebook[...]`; its code parses, and its checks come out true."""

import os

import pytest

from tests.ports.ports import PORTS, execute, mathics

pytestmark = [pytest.mark.slow, pytest.mark.others]
(WOLFRAM,) = (port for port in PORTS if port.name == "wolfram")

# All code cells are evaluated in their order, but for the first, which asks for the folder of
# the front end, and the last, which draws. The scene is smaller: Mathics3 takes minutes else.
SCRIPT = """
notebook = Get["{sources}/Icp2d.nb"];
code = Cases[notebook, Cell[text_String, "Input"] :> text, Infinity];
Print[Head[notebook]];
Print[Length[code]];
Print[Select[code, ! SyntaxQ[#] &]];
Get["{sources}/Icp2d.wl"];
small = StringReplace[code, "simulateScans[7]" -> "simulateScans[7, 12]"];
values = ToExpression /@ Take[small, {{2, -2}}];
Print[values[[3]]];
Print[Max[Abs[Last[values]]] < 0.02];
"""


def test_its_code_parses_and_its_checks_hold(tmp_path):
    """Slow (Mathics3 starts in 4 s): nothing else opens the notebook, or runs its derivation."""
    if WOLFRAM.missing:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(WOLFRAM.missing)
    script = tmp_path / "script.wl"
    script.write_text(SCRIPT.format(sources=WOLFRAM.sources.as_posix()))
    outcome = execute([str(mathics()), "--quiet", "-f", script])
    assert outcome.stdout.split("\n") == ["Notebook", "8", "{}", "{True, True}", "True", ""]
