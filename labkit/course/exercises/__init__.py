"""Checks for the exercises of the chapters: they try a function and name the mistake.

In a chapter an exercise with code is one cell with the tag ``stub``, below its text::

    def turn_about(c, theta):
        '''Transform (3, 3) that turns the plane by `theta` [rad] about the point `c` (2,).'''
        raise NotImplementedError  # your code here


    check(turn_about)

The stub keeps quiet as long as nothing is written, so the chapter runs from end to end. The
solution stands below it, in cells with the tag ``solution``, and ends in the same call of
`check`; the students' edition takes these cells away and keeps the stub. What follows and needs
the function stands below ``if check(turn_about).passed:``.

**To add an exercise**, write a right function of the same name in the module of its chapter's
topic here, what it is tried on, and the mistakes that it knows (a new module is found by itself)::

    @exercise("Turn about a point", {
        "a turn by 0.7 rad about (2, −1)": (np.array([2.0, -1.0]), 0.7),
    }, {
        "This turns about the origin: bring `c` there first.": lambda c, theta: ...,
        "This turns the other way.": {"rotation(theta)": "rotation(-theta)"},
    })
    def turn_about(c, theta):
        ...  # by another way than the solution in the notebook, where there is one

Each mistake is a wrong function, or the right one with some of its text replaced, by the sentence
that is said of it. A name is said only where its function gives all of the answers that came, the
right ones among them; so a mistake may be right in some cases, and no two may agree in all.
Three things are known everywhere, and need no entry: relations to the right answer (the inverse,
the sign, degrees, the order of two results), arguments that are misread (squared, in degrees, one
round too few, exchanged: `misreadings`), and what a call with plain arguments shows: one round, no
gate, no guess (`stages` has an argument's plain form by its name, so name them as the lab does).
List the mistakes whose sentence says more than that, an idea.
"""

from labkit.course.exercises.checking import check, exercises, score
from labkit.course.exercises.entries import exercise

__all__ = ["check", "exercise", "exercises", "score"]
