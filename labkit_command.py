"""Starts the command ``labkit``: an interruption while it loads ends it in one line."""

import os
import signal
import sys


def main() -> int:
    """Load the command line and run it; the exit status."""
    interrupt = signal.getsignal(signal.SIGINT)
    if interrupt is signal.default_int_handler:  # an import that is interrupted fails anyhow
        signal.signal(signal.SIGINT, _leave)
    try:
        from labkit.cli import main as run  # noqa: PLC0415
    finally:
        signal.signal(signal.SIGINT, interrupt)
    return run()


def _leave(number: int, frame: object) -> None:
    """End at once: nothing is written yet."""
    os.write(2, b"\nlabkit: interrupted; no file is left half-written\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(main())
