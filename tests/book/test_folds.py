"""A page shows of an exercise what its reader needs, and not how it is made."""

from docutils import nodes
from docutils.utils import new_document
from folds import tidy_cells


def test_no_mark_of_a_solution_and_no_hidden_test_is_in_a_page_s_code():
    source = (
        "def f(x):\n    ### BEGIN SOLUTION\n    return 2 * x\n    ### END SOLUTION\n\n\n"
        "check(f)\n### BEGIN HIDDEN TESTS\nassert check(f).passed\n### END HIDDEN TESTS"
    )
    page = new_document("page")
    page += nodes.literal_block(source, source)

    tidy_cells(None, page)

    assert page.astext() == "def f(x):\n    return 2 * x\n\n\ncheck(f)"
