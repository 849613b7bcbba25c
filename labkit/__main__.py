"""The command ``labkit``, also as ``python -m labkit``: an interrupt ends it in one line."""

import signal
import sys

from labkit.support.interrupts import INTERRUPTED, MESSAGE, loading


def main() -> int:
    """Load the command line and run it; the exit status."""
    try:
        with loading():
            from labkit.cli import main as run  # noqa: PLC0415 (an interrupt may meet the loading)

        return run()
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second one changes nothing
        print(end=MESSAGE, file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
