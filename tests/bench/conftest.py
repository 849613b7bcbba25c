"""Keep pytest out: nothing here is a test, and the peers are not in the lab's environment."""

collect_ignore_glob = ["*"]
