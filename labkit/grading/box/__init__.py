"""The box: a throw-away process behind a wall, in which students' code runs."""
