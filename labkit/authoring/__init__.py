"""Writing the assignment: questions, cases, right answers and known wrong ones.

``python -m labkit.authoring`` computes all of it afresh and writes the files that
`labkit.grading.assignment` reads and the notebook that students get. This side knows the
answers, so nothing of grading or of the notebooks imports it, and students do not get it.

==================  ==============================================================
`questions/`        the texts, points and limits, in TOML: to be edited by instructors
`cases`             what the functions are called with, as recipes for any seed
`references`        the right answers, by labkit
`misconceptions`    wrong answers, each by a function that makes the mistake
`solution`          the right submission from which the instructor's notebook is made
`tolerance`         how far an answer may lie from the reference, and why
`compute`           cases with answers, refused where they do not tell mistakes apart
`notebook`          the notebook that is handed out
==================  ==============================================================
"""
