"""Where students' code runs: `host` is the grader's side, `inside` all that a sandbox sees."""
