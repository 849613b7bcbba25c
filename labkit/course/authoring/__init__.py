"""Writing the assignment: questions, cases, right answers and known wrong ones.

``python -m labkit.course.authoring`` computes all of it afresh and writes the files that
`labkit.course.grading.assignment` reads and the notebook that students get. This side knows the
answers, so nothing of grading or of the notebooks imports it, and students do not get it.

==================  ==============================================================
`questions/`        the texts, points and limits, in TOML: to be edited by instructors
`sections/`         what the functions are called with, for any seed, and wrong answers
`solution`          the right submission: the reference, and the instructor's notebook
`entries`           the form of a section, and the solution with some of its text changed
`references`        the right answers, and how far another may lie from them
`compute`           cases with answers, refused where they do not tell mistakes apart
`write`             the assignment's files, and the notebook that is handed out
==================  ==============================================================
"""
