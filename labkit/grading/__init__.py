"""Grading of what students hand in: it knows questions and cases, and nothing of what they ask.

Ten ideas, each in its room, in the order in which a hand-in meets them:

==================  ==========================================  ====================================
hand-ins            ``classroom/handins.py``                    whose is which file, by five layouts
the box             ``box/outside.py``, ``watch.py``;           one process that is thrown away, and
                    ``inside/confine.py``, ``limits.py``        all that it may take
reading             ``box/inside/reading.py``, ``parsing.py``   files to cells, cells to statements
the session         ``box/inside/session.py``, ``calling.py``;  runs cells, keeps what they define,
                    ``standins.py``, ``data.py``                calls it; plain data goes out
lending             ``box/inside/lending.py``                   each asked function is a slot, into
                                                                which a right one may go
grading             ``grade.py``, ``sitting.py``                visible cases, then hidden ones
the assignment      ``questions.py``                            questions and cases, as data
judging             ``judge/``                                  right or wrong, and why; for `check`
records and marks   ``classroom/store.py``, ``marks.py``        verdicts by what they follow from;
                                                                points, lateness, groups by people
what comes out      ``classroom/results.py`` and beside it;     scores, gradebooks, pages, code;
                    ``command.py``                              the commands
==================  ==========================================  ====================================

``classroom/rounds.py`` leads a class through them, and ``classroom/gradescope.py`` one hand-in;
``classroom/tables.py`` reads and writes CSV for the last two. A new layout is an entry of
`handins.LAYOUTS`, a new gradebook one of `platforms.GRADEBOOKS`, a new question one of the course.
"""
