"""The program itself: ``python -m pointillist render scene.xml``."""

import signal
import sys

from ._native import command


def main() -> int:
    """Runs the program with the words of the command line, and returns its exit code."""
    # Ctrl-C is the program's: the first one ends a render with the picture so far.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return command(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
