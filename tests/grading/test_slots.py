"""Law 2, however a wrong function is bound, defined and answered."""

import pytest

from tests.grading.failing import ASSIGNMENT, parameters
from tests.grading.notebooks import RIGHT, answered

BINDINGS = {  # how a caller reaches another function: what stands above it, and how it calls
    "name": ("", "{name}"),
    "alias": ("use_{name} = {name}", "use_{name}"),
    "default": ("def use_{name}(*given, own={name}):\n    return own(*given)", "use_{name}"),
    "dict": ("tools_{name} = {{'own': {name}}}", "tools_{name}['own']"),
    "partial": ("import functools\nuse_{name} = functools.partial({name})", "use_{name}"),
    "method": ("class Use_{name}:\n    run = staticmethod({name})", "Use_{name}().run"),
    "closure": ("use_{name} = (lambda own: lambda *given: own(*given))({name})", "use_{name}"),
    "keywords": ("", "(lambda *given: {name}(**dict(zip({parameters}, given))))"),
    "another file": ("import helpers", "helpers.{name}"),
    "name of another file": ("from helpers import {name} as use_{name}", "use_{name}"),
}
CALLEES = ("rotation", "nearest_neighbors", "huber_weights")
WRONG = {
    "returns nothing": "def {name}({parameters}):\n    None\n",
    "returns one number": "def {name}({parameters}):\n    return 0.125\n",
    "is no function": "class Own:\n    def __call__(self, {parameters}):\n        pass\n"
    "{name} = Own()\n",
    "cannot be parsed": "def {name}(:\n",
}


def bind(source, binding):
    """The source of a caller that reaches other functions in some way."""
    for name in CALLEES:
        above, call = (
            part.format(name=name, parameters=parameters(name)) for part in BINDINGS[binding]
        )
        if f"{name}(" in source:
            source = above + "\n" + source.replace(f"{name}(", f"{call}(")
    return source


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("binding", BINDINGS)
def test_however_a_wrong_function_is_bound_its_callers_keep_their_points(binding, wrong, graded):
    """Law 2: ways to bind × ways to be wrong, for three functions that others call."""
    if "file" in binding and wrong == "cannot be parsed":
        pytest.skip("a file without the function cannot be asked for it")
    sources = {
        name: WRONG[wrong].format(name=name, parameters=", ".join(parameters(name)))
        for name in CALLEES
    }
    helpers = "\n".join(["import numpy as np", *sources.values()]).encode()
    callers = {name: bind(RIGHT[name], binding) for name in RIGHT if name not in CALLEES}
    files = {"a.ipynb": answered(sources | callers, closing=False), "helpers.py": helpers}

    verdict = graded(files, ASSIGNMENT)

    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == {*CALLEES}, [one for one in verdict.questions if not one.passed]


OTHERWISE = {  # where a function is defined that is then assigned to its name, and how it is called
    "first name": ("def search(source, target):\n    pass\n", "search"),
    "static method": (
        "class Tools:\n    @staticmethod\n    def search(source, target):\n        pass\n",
        "Tools.search",
    ),
    "method": (
        "class Tools:\n    def search(self, source, target):\n        pass\n",
        "Tools().search",
    ),
}


@pytest.mark.parametrize("place", OTHERWISE)
def test_where_a_wrong_function_is_defined_is_all_one_to_its_callers(place, graded):
    """Law 2: they call it there, and not by the name that is asked for."""
    definition, call = OTHERWISE[place]
    changed = {
        "nearest_neighbors": f"{definition}nearest_neighbors = {call}\n",
        "icp_step": RIGHT["icp_step"].replace("nearest_neighbors(", f"{call}("),
    }

    verdict = graded({"a.ipynb": answered(changed, closing=False)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["nearest_neighbors"]


NAMESAKE = """class Pose:
    def __init__(self, T):
        self.T = T
    def invert(self):
        return Pose(np.linalg.inv(self.T))
def invert(T_a_b):
    return 7.0
"""


def test_a_method_with_the_name_of_a_question_stays_the_student_s_own(graded):
    """Law 2: a wrong function of that name is another one."""
    last = "(invert(T_before), Pose(T_before).invert().T)[1]"
    changed = {"invert": NAMESAKE, "icp": RIGHT["icp"].replace("invert(T_before)", last)}

    verdict = graded({"a.ipynb": answered(changed, closing=False)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["invert"]


def test_who_shares_a_word_with_an_experiment_does_not_hang_on_what_that_mentions(graded):
    """Law 2: the inverse reads `R.T`, and `T` is an array of an experiment."""
    changed = {"has_converged": "def has_converged(*given):\n    while True:\n        pass\n"}
    experiment = "T = np.eye(3) if callable(has_converged) else None"
    files = {"a.ipynb": answered(changed, before=(experiment,), closing=False)}

    verdict = graded(files, ASSIGNMENT, seconds=1.0)

    assert [one.question for one in verdict.questions if not one.passed] == ["has_converged"]


def test_a_package_s_function_that_is_taken_for_an_answer_stays_what_it_is(graded):
    """Law 2: a right one acts in place of the answer, and not where the package's is called."""
    changed = {
        "rotation": "from numpy import eye\nrotation = eye\n",
        "icp_step": RIGHT["icp_step"].replace("np.eye(3)", "eye(3)"),
    }

    verdict = graded({"a.ipynb": answered(changed, closing=False)}, ASSIGNMENT)

    assert [one.question for one in verdict.questions if not one.passed] == ["rotation"]


FORMS = {  # accepted forms of answers: from the usual one, and back from this form alone
    "rows": ("rotation", "value.tolist()", "np.array(value[0] + value[1]).reshape(2, 2)"),
    "tuples": ("rotation", "tuple(map(tuple, value))",
               "np.reshape((*value[0], *value[1]), (2, 2))"),
    "matrix": ("align_weighted", "np.block([[value[0], value[1][:, None]], [0, 0, 1]])",
               "(value[:2, :2], value[:2, 2])"),
    "dict": ("align_weighted", "{'R': value[0], 't': value[1]}", "(value['R'], value['t'])"),
    "column": ("align_weighted", "(value[0], value[1][:, None])", "(value[0], value[1][:, 0])"),
    "pair": ("icp_step", "[value[:2, :2], value[:2, 2]]",
             "np.block([[value.pop(0), value.pop(0)[:, None]], [0, 0, 1]])"),
    "lists": ("nearest_neighbors", "[part.tolist() for part in value]",
              "tuple(np.array(part + []) for part in value)"),
    "one array": ("nearest_neighbors", "np.array(value)",
                  "(value[0].astype(int), value[1, :])"),
    "ones": ("distance_gate", "value.astype(int)", "np.array([False, True])[value * 1]"),
    "list": ("huber_weights", "value.tolist()", "np.array(value + [])"),
}  # fmt: skip
IN_FORM = """right_{name} = {name}
def {name}(*given):
    value = right_{name}(*given)
    value = (value[0], value[1] + 1) if isinstance(value, tuple) else 1 - value
    return {form}
def use_{name}(*given):
    value = {name}(*given)
    return {back}
"""


@pytest.mark.parametrize("form", FORMS)
def test_a_right_function_answers_its_callers_in_the_form_of_the_wrong_one(form, graded):
    """Law 2: whoever takes another accepted form from a wrong function keeps the points."""
    name, there, back = FORMS[form]
    wrong = IN_FORM.format(name=name, form=there, back=back)
    callers = {
        other: source.replace(f"{name}(", f"use_{name}(")
        for other, source in RIGHT.items()
        if other != name
    }
    files = {"a.ipynb": answered(callers | {name: RIGHT[name] + wrong}, closing=False)}

    verdict = graded(files, ASSIGNMENT)

    lost = {one.question for one in verdict.questions if not one.passed}
    assert lost == {name}, [one for one in verdict.questions if not one.passed]
