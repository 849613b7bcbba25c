"""``python -m labkit``: the command line where the console command is not on the path."""

import sys

from labkit_command import main

sys.exit(main())
