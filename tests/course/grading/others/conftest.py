"""Keep pytest out: what is here runs in the other graders' own environment."""

collect_ignore_glob = ["*"]
