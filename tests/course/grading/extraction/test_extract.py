"""Answers are found whatever else a submission holds; what is found runs as the student meant."""

import json
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labkit.course.grading.extraction.extract import extract
from labkit.course.grading.sandbox.inside.imports import Library

FUNCTIONS = {"rotation": "rotation", "weights": "huber_weights"}
IMPORT = "import math"
ROTATION = "def rotation(angle):\n    return [[math.cos(angle), 0], [0, math.cos(angle)]]"
WEIGHTS = "def huber_weights(r, delta):\n    return [min(1, delta / x) for x in r]"
STUB = 'def rotation(angle):\n    """Turn."""\n    # YOUR CODE HERE\n    raise NotImplementedError'


def notebook(*cells, **fields):
    """A notebook of code cells; a pair is a cell with nbgrader's name for it."""
    code = [
        {"cell_type": "code", "source": cell, "metadata": {}, "outputs": []}
        if isinstance(cell, str)
        else {
            "cell_type": "code",
            "source": cell[1],
            "metadata": {"nbgrader": {"grade_id": cell[0]}},
        }
        for cell in cells
    ]
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "cells": code, **fields}).encode()


def run(extraction):
    """What the cells define, run one after the other as a sandbox would."""
    names, own = {}, Library({})
    sys.meta_path.insert(0, own)
    try:
        for cell in extraction.cells:
            if cell.modules:
                own.carry(cell.source, cell.label, cell.modules)
            else:
                exec(compile(cell.source, cell.label, "exec"), names)
    finally:
        sys.meta_path.remove(own)
        for name in own.sources:
            sys.modules.pop(name, None)
    return names


def extracted(*cells):
    return extract({"a.ipynb": notebook(*cells)}, FUNCTIONS)


@given(
    st.permutations([IMPORT, ROTATION, WEIGHTS, "print('hello')", "x = 1 / 0", "while True: pass"])
)
def test_cells_in_any_order_among_cells_that_fail_or_hang(cells):
    names = run(extracted(*cells))
    assert names["rotation"](0.0)[0][0] == 1.0
    assert names["huber_weights"]([2.0], 1.0) == [0.5]


@pytest.mark.parametrize(
    "noise",
    [
        "%matplotlib inline",
        "!pip install numpy",
        "%%bash\nrm -rf /",
        "rotation?",
        "answer = input('name? ')",
        "import ipywidgets\nipywidgets.interact(rotation, angle=(0, 1))",
        "plt.plot(rotation(1.0)); plt.show()",
        "check('rotation', rotation)",
        "assert rotation(0.0) == 'wrong'",
        "for k in range(10**12): rotation(k)",
    ],
)
def test_what_stands_beside_an_answer_is_left_out(noise):
    plain = extracted(IMPORT, ROTATION)
    noisy = extracted(noise, IMPORT, ROTATION + "\n" + noise if "%%" not in noise else ROTATION)
    kept = [cell.source.strip() for cell in noisy.cells if "ipywidgets" not in cell.source]
    assert kept == [cell.source.strip() for cell in plain.cells]


def test_a_magic_keeps_the_numbers_of_the_lines():
    (cell,) = extracted("%%time\n%pylab\n" + ROTATION).cells
    assert cell.source.split("\n")[2:] == ROTATION.split("\n")


@pytest.mark.parametrize(
    "statement",
    [
        "theta = (theta\n    % (2 * math.pi))",
        "theta = [theta\n% 3][0]",
        "theta = theta \\\n    % 3",
        '"""How far?\n%s off\n!"""',
        "text = '''\\'''%\n?''' + f'{theta}(' # (",
    ],
)
def test_a_line_that_goes_on_is_no_magic(statement):
    magics = "%matplotlib inline\nfiles = !ls (\nrotation??\n!echo \"it's"
    answer = f"import math\ndef rotation(theta):\n    %time\n    {statement}\n    return theta"
    for cell in (f"{magics}\n{answer}", f"{answer}\n{magics}"):
        found = extracted(cell)
        assert found.notes == ()
        assert statement in found.cells[-1].source
        assert run(found)["rotation"](2.0) == 2.0


def test_an_answer_brings_what_it_needs():
    helper = "SCALE = 2.0\ndef helper(x):\n    return SCALE * x"
    table = "table = []\nfor k in range(3):\n    table.append(k)\ntable[0] = 7"
    answer = "def rotation(angle):\n    return helper(angle), table"
    assert run(extracted(helper, table, answer, "unused = 1"))["rotation"](3.0) == (6.0, [7, 1, 2])
    assert "unused" not in run(extracted(helper, table, answer, "unused = 1"))


@pytest.mark.parametrize(
    ("cell", "answer"),
    [
        ("def setup():\n    global SIGN\n    SIGN = -1\nsetup()", "SIGN"),
        (
            "SIGN = 1\ndef setup():\n    global SIGN\n    SIGN = -1\nif True:\n    done = setup()",
            "SIGN",
        ),
        ("P = {}\ndef setup(sign):\n    P['sign'] = sign\nsetup(-1)", "P['sign']"),
        ("def a():\n    global S\n    S = -1\ndef b():\n    a()\nfor _ in 'once': b()", "S"),
        ("class K: pass\nk = K()\nsetattr(k, 'sign', -1)", "k.sign"),
        ("P = {}\ndict.update(P, sign=-1)", "P['sign']"),
        ("P = []\nlist.append(P, -1)", "P[0]"),
        ("import numpy as np\nP = np.ones(3)\nnp.copyto(P, -1.0)", "P[0]"),
        ("import numpy as np\nP = np.ones((3, 3))\nnp.fill_diagonal(P[1:], -1.0)", "P[1, 0]"),
        ("import heapq\nP = []\nheapq.heappush(P, -1)", "P[0]"),
    ],
)
def test_a_call_that_gives_a_value_by_the_way_is_kept(cell, answer):
    found = extracted(cell, f"def rotation(angle):\n    return {answer}")
    assert run(found)["rotation"](0.0) == -1


@pytest.mark.parametrize(
    "trial",
    [
        "rotation(load())",
        "print(rotation, history); display(history); plt.plot(history)",
        "check('rotation', rotation)\nsorted(history)",
        "def trial():\n    history = [1]\n    history.append(rotation(load()))\ntrial()",
        "def trial():\n    return rotation(load())\ntrial()",
    ],
)
def test_a_call_that_tries_an_answer_is_left_out_though_the_answer_counts_its_calls(trial):
    answer = "history = []\ndef rotation(angle):\n    global history\n    history += [angle]"
    found = extracted("import matplotlib.pyplot as plt", answer, trial)
    assert "".join(cell.source for cell in found.cells[1:]).strip() == answer


def test_each_cell_belongs_to_its_question_and_shared_ones_to_none():
    both = "def rotation(a):\n    return f(a)\ndef huber_weights(r, d):\n    return f(rotation(r))"
    cells = extracted("import math\ndef f(x):\n    return x", both).cells
    assert [cell.question for cell in cells] == [None, None, "rotation", "weights"]
    assert {cell.label for cell in cells[2:]} == {"code cell 2 of a.ipynb"}


def test_a_failing_import_costs_no_other_one():
    cells = extracted("import no_such_thing\nimport math", ROTATION).cells
    assert [cell.source.strip() for cell in cells][:2] == ["import no_such_thing", "import math"]


def test_the_last_answer_counts_and_the_student_is_told():
    found = extracted("def rotation(a):\n    return 1", "def rotation(a):\n    return 2")
    assert run(found)["rotation"](0.0) == 2
    assert found.notes == (
        "`rotation` is defined 2 times; the last one counts, in code cell 2 of a.ipynb",
    )


@pytest.mark.parametrize("cells", [(STUB, IMPORT, ROTATION), (IMPORT, ROTATION, STUB)])
def test_an_untouched_stub_hides_no_answer(cells):
    found = extracted(*cells)
    assert run(found)["rotation"](0.0)[0][0] == 1.0
    assert found.notes == ()


def test_a_stub_alone_is_the_answer():
    with pytest.raises(NotImplementedError):
        run(extracted(STUB))["rotation"](0.0)


@pytest.mark.parametrize(
    "imported",
    [
        "from labkit.se2 import rotation",
        "import somewhere as rotation",
        "try:\n    from fast import rotation\nexcept ImportError:\n    from slow import rotation",
    ],
)
@pytest.mark.parametrize("definition", [ROTATION, "rotation = lambda angle: 1"])
def test_an_import_hides_no_answer_wherever_it_stands(imported, definition):
    for cells in ((imported, definition), (definition, imported)):
        apart = {f"{number}.ipynb": notebook(cell) for number, cell in enumerate(cells)}
        for found in (extracted(*cells), extract(apart, FUNCTIONS)):
            assert found.cells[-1].source.strip() == definition
            assert found.cells[-1].question == "rotation"
            assert found.notes == ()


def test_an_imported_name_can_be_a_helper_of_the_students_own():
    """`from labkit import transform` stands in a chapter, or was tried once."""
    helper = "def transform(angle):\n    return 2 * angle\ntransform.calls = 0"
    answer = "def rotation(angle):\n    return transform(angle), transform.calls"
    imported = "from math import sqrt as transform"
    assert run(extracted(helper, imported, answer))["rotation"](3.0) == (6.0, 0)


@pytest.mark.parametrize("stub", [(), (STUB,)], ids=["", "and a stub"])
@pytest.mark.parametrize("imported", ["from mine import *", "from mine import rotation"])
def test_a_stub_hides_no_answer_in_a_module(imported, stub):
    module = f"{IMPORT}\n{ROTATION}".encode()
    found = extract({"a.ipynb": notebook(imported, *stub), "mine.py": module}, FUNCTIONS)
    assert run(found)["rotation"](0.0)[0][0] == 1.0


OLDER = "def rotation(angle):\n    return SCALE\nSCALE = broken()\n"


@pytest.mark.parametrize("names", [("a", "b"), ("b", "a")], ids="".join)
def test_of_two_files_the_one_that_answers_more_counts(names):
    """In it, a name means what it gives it: a chapter's `SCALE` is another one."""
    whole = f"SCALE = 2.0\ndef rotation(angle):\n    return SCALE\n{WEIGHTS}"
    files = dict(zip(names, (whole.encode(), OLDER.encode()), strict=True))
    found = extract({f"{name}.py": files[name] for name in "ab"}, FUNCTIONS)
    assert not any("broken" in cell.source for cell in found.cells)
    assert run(found)["rotation"](0.0) == 2.0
    assert found.notes == (
        "`rotation` is defined 2 times; the one beside most other answers counts, "
        f"in {names[0]}.py",
    )


def test_of_two_files_that_answer_as_much_the_one_with_more_stubs_counts():
    stub = "def huber_weights(r, delta):\n    ..."
    found = extract({"a.ipynb": notebook(ROTATION, stub), "b.py": OLDER.encode()}, FUNCTIONS)
    assert [cell.source.strip() for cell in found.cells] == [ROTATION, stub]


def test_a_name_that_its_file_does_not_give_is_looked_for_in_the_others():
    part = b"def rotation(angle):\n    return SCALE\nSCALES = [SCALE]\n"
    found = extract({"a.py": part, "b.py": b"SCALE = 2.0"}, FUNCTIONS)
    assert run(found)["rotation"](0.0) == 2.0


def test_a_syntax_error_costs_its_cell_alone():
    broken = "def huber_weights(r, d):\n    return ("
    found = extracted(IMPORT, ROTATION, broken)
    assert [(c.question, c.source) for c in found.cells][-1] == ("weights", broken)
    assert found.notes[0].startswith(
        "code cell 3 of a.ipynb is not Python, so nothing in it counts"
    )
    assert "line 2" in found.notes[0]
    assert [c.question for c in extracted(WEIGHTS, broken).cells] == ["weights"]


def test_a_slip_in_the_name_is_pointed_out():
    found = extracted("def huber_weight(r, d):\n    return r")
    assert found.notes == ("there is no `huber_weights`, but `huber_weight`: is that a slip?",)


def test_answers_in_a_module_that_the_notebook_imports():
    files = {
        "a.ipynb": notebook("from mine import *\nfrom mine import rotation"),
        "mine.py": f"{IMPORT}\n{ROTATION}\n{WEIGHTS}".encode(),
    }
    names = run(extract(files, FUNCTIONS))
    assert names["rotation"](0.0)[0][0] == 1.0
    assert names["huber_weights"]([2.0], 1.0) == [0.5]


@pytest.mark.parametrize(
    ("first", "files"),
    [
        ("from aaa import *", {"aaa.py": "from zzz import *", "zzz.py": ROTATION}),
        ("from aaa import rotation", {"b.py": ROTATION, "aaa.py": "from b import rotation"}),
        ("from lab import *", {"lab/__init__.py": "from .a import *", "lab/a.py": ROTATION}),
        ("from lab import *", {"lab/__init__.py": "from . import a\nfrom .a import rotation"}),
        ("import src.a as a\nrotation = a.rotation", {"x y/src/a.py": ROTATION}),
        ("from src import a\nrotation = a.rotation", {"src/a.py": ROTATION}),
        ("from lab.a import rotation", {"lab/a.py": "from .b import *", "lab/b.py": ROTATION}),
        ("from lab.a.b import *", {"lab/a/b.py": "from ..c import rotation", "lab/c.py": ROTATION}),
    ],
)
@pytest.mark.parametrize("stub", [(), (STUB,)], ids=["", "and a stub"])
def test_scripts_import_each_other_as_they_do_at_home(first, files, stub):
    files = {"lab/a.py": ROTATION, **files} if "lab/__init__.py" in files else files
    sources = {name: f"{IMPORT}\n{text}".encode() for name, text in files.items()}
    found = extract({"a.ipynb": notebook(first, *stub), **sources}, FUNCTIONS)
    assert run(found)["rotation"](0.0)[0][0] == 1.0


@pytest.mark.parametrize("name", ["a.ipynb.txt", "a.IPYNB.json"])
def test_a_notebook_is_one_whatever_ending_a_browser_gave_it(name):
    found = extract({name: notebook(f"%%writefile mine.py\n{IMPORT}\n{ROTATION}")}, FUNCTIONS)
    assert run(found)["rotation"](0.0)[0][0] == 1.0
    assert extract({name: notebook("%%writefile a.txt\ndef rotation(a):")}, FUNCTIONS).notes == ()


def test_scripts_and_older_notebooks():
    assert "rotation" in run(extract({"a.py": f"{IMPORT}\r\n{ROTATION}".encode()}, FUNCTIONS))
    old = {"nbformat": 3, "worksheets": [{"cells": [{"cell_type": "code", "input": ROTATION}]}]}
    assert "rotation" in run(extract({"a.ipynb": json.dumps(old).encode()}, FUNCTIONS))
    lines = notebook(ROTATION).replace(b"\\n    return", b'\\n", "    return', 1)
    parts = json.loads(
        lines.decode().replace('"source": "', '"source": ["').replace('", "m', '"], "m')
    )
    assert "rotation" in run(extract({"a.ipynb": json.dumps(parts).encode()}, FUNCTIONS))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is no notebook"),
        (b"[1]", "it has no list of cells"),
        (b'{"cells": 3}', "it has no list of cells"),
        (b'{"cells": [' + b"1," * 6000 + b"1]}", "has 6001 cells; at most 5000 are read"),
        (b"\xff\x00", "is no text: byte 0 is not UTF-8"),
        (b"[" * 100_000, "is no notebook"),
    ],
)
def test_a_file_that_cannot_be_read_costs_itself(data, says):
    files = {"bad.ipynb": data, "good.py": f"{IMPORT}\n{ROTATION}".encode()}
    found = extract(files, FUNCTIONS)
    assert "rotation" in run(found)
    assert found.unread[0].startswith("bad.ipynb")
    assert says in found.unread[0]


@pytest.mark.parametrize(
    "source",
    [
        "x = 1" + "+1" * 2500,
        "x = 1" + "+1" * 200_000,
        "-" * 100_000 + "1",
        "(" * 5000,
        "a." * 100_000 + "b",
        "def rotation(a):\n" + " " * 100_000,
        " " * 100_000 + "?",
        "x\0y",
    ],
)
def test_a_text_made_to_choke_a_parser_is_read_or_refused(source):
    found = extract({"a.py": source.encode(), "b.py": f"{IMPORT}\n{ROTATION}".encode()}, FUNCTIONS)
    assert run(found)["rotation"](0.0)[0][0] == 1.0


@pytest.mark.parametrize(
    "source",
    [
        *(f"def huber_weights(r, d):\n    raise x{'+1' * depth}" for depth in (500, 900, 1500)),
        *("if a: huber_weights = 1\n" + "elif a: pass\n" * depth for depth in (500, 990, 1400)),
        *(f"def huber_weights(r, d):\n    return r{'.a' * depth}" for depth in range(2970, 2990)),
    ],
    ids=lambda source: f"{source[:9]} {len(source)}",
)
def test_an_answer_that_is_nested_as_deeply_as_the_compiler_allows_hurts_no_other(source):
    found = extract({"a.py": source.encode(), "b.py": f"{IMPORT}\n{ROTATION}".encode()}, FUNCTIONS)
    assert any("def rotation" in cell.source for cell in found.cells)


@pytest.mark.parametrize(
    ("source", "says"),
    [
        ("import math\n" * 60_000, "60000 lines of code (5242 at most)"),
        ("a;" * 500_000, "500000 lines of code (5242 at most)"),
        ("a\n" * (1 << 20), "1048576 lines of code (5242 at most)"),
        ("f'" + "{a}" * 100_000 + "'", "300003 words and signs (43690 at most)"),
        ("x" * 300_000, "300000 characters of code (262144 at most)"),
    ],
    ids=["imports", "one line", "statements", "a string", "a name"],
)
def test_code_that_would_keep_the_grader_busy_is_refused(source, says):
    """Each took from twenty seconds to minutes, or gigabytes, before any sandbox was asked."""
    for name, data in {"a.py": source.encode(), "a.ipynb": notebook(source)}.items():
        found = extract({name: data, "b.py": f"{IMPORT}\n{ROTATION}".encode()}, FUNCTIONS)
        assert "rotation" in run(found)
        assert f"{name} is too long to be read, by its {says}" in found.unread[0]


@pytest.mark.parametrize(
    ("source", "says"),
    [
        ("def f():\n " + ";".join(f"a{i}=lambda:b{i}" for i in range(2600)), "2601 functions and"),
        ("def f():\n" + " x=lambda:0\n" * 2700, "2701 functions and loops (2621 at"),
        ("def f(): return [" + "[0for x in y]," * 2700 + "]", "2701 functions and loops (2621 at"),
        ("def f(): return f'" + "{x}" * 14_000 + "'", "f-strings hold more fields than"),
        ("def f(): return rF'''" + "{x}{x}\n" * 5_000 + "'''", "f-strings hold more fields than"),
        ("import " + "a.\t" * 15_000 + "a", "a name with more dots than"),
        ("from a" + " . a" * 12_000 + " import b", "a name with more dots than"),
    ],
    ids=[
        "names",
        "functions",
        "comprehensions",
        "fields",
        "fields in lines",
        "dots",
        "spaced dots",
    ],
)
def test_code_that_the_compiler_would_take_seconds_for_is_not_compiled(source, says):
    found = extract({"a.py": source.encode(), "b.py": f"{IMPORT}\n{ROTATION}".encode()}, FUNCTIONS)
    assert "rotation" in run(found)
    assert says in (*found.notes, *found.unread)[0]


def test_a_long_notebook_with_many_functions_and_figures_of_speech_is_read():
    """Some ten times what an answer to the assignment holds."""
    helpers = (f"def g{i}(a, b):\n    return [f'{{a}} {{b:.{i}}}' for x in a]" for i in range(400))
    found = extract({"a.ipynb": notebook(IMPORT, *helpers, ROTATION)}, FUNCTIONS)
    assert "rotation" in run(found)
    assert not found.notes


def test_so_much_code_is_read_and_no_more():
    """An import stands in a cell of its own, which has all the empty lines above it."""
    source = b"import a\n" * 4900
    found = extract({f"{n}.py": source for n in range(40)}, FUNCTIONS)
    assert found.passages == ()
    assert "too much code together; 4.py is not read" in found.unread[0]


def test_a_notebook_of_a_million_empty_things_is_not_unfolded():
    data = b'{"cells": [' + b"{}," * 2_100_000 + b"1]}"
    assert "too large a notebook; clear its outputs" in extract({"a.ipynb": data}, {}).unread[0]


def test_remarks_are_cut_where_there_are_too_many():
    found = extract({"a.ipynb": notebook(*["x x"] * 300)}, FUNCTIONS)
    assert len(found.notes) == 41
    assert found.notes[-1] == "and 260 remarks more"


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_bytes_end_in_cells_or_notes(data):
    extract({"a.py": data, "b.ipynb": data}, FUNCTIONS)


def test_scripts_that_no_answer_needs_are_left_out():
    """A whole repository holds many, which import each other and what is not there."""
    files = {
        "answers.py": b"import helpers\ndef rotation(theta):\n    return helpers.turn(theta)\n",
        "helpers.py": b"import math\ndef turn(theta):\n    return math.cos(theta)\n",
        "build.py": b"import no_such_thing\nimport tools\n",
        "tools.py": b"import no_such_thing_either\nHERE = __file__\n",
    }
    found = extract(files, {"rotation": "rotation"})
    assert [cell.label for cell in found.cells] == ["helpers.py", "answers.py", "answers.py"]
    assert not any("no_such_thing" in cell.source for cell in found.cells)
    alone = extract({name: files[name] for name in ("build.py", "tools.py")}, {"q": "rotation"})
    assert {cell.label for cell in alone.cells} == {"build.py", "tools.py"}


def test_a_script_of_ones_own_knows_its_file():
    files = {
        "a.py": b"from mine import NAME\ndef f():\n    return NAME\n",
        "mine.py": b"NAME = __file__\n",
    }
    assert run(extract(files, {"q": "f"}))["f"]() == "mine.py"


@pytest.mark.parametrize("lost", ["", "import numpy as np\nprint("])
def test_an_import_that_was_handed_out_is_put_back(lost):
    found = extracted(*filter(None, [lost, "def rotation(theta):\n    return np.cos(theta)"]))
    assert found.cells[0].source == "import numpy as np"
    assert any("`np` is used and never imported" in note for note in found.notes)
    assert run(found)["rotation"](0.0) == 1.0


@pytest.mark.parametrize(
    "given", ["import numpy as np", "from numpy import *\nimport numpy as np", "np = Fake()"]
)
def test_an_import_that_is_there_is_not_put_back(given):
    found = extracted(given, "def rotation(theta):\n    return np.cos(theta)")
    assert not any("never imported" in note for note in found.notes)
