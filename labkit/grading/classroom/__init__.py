"""The work on a class: hand-ins, stored verdicts, marks, and what goes back to platforms."""
