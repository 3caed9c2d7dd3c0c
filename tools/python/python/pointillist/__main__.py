"""The program itself: ``python -m pointillist render scene.xml``."""

import os
import signal
import sys

from . import _native


def _name_program() -> None:
    """Names the files of the program for a subcommand that starts it again: its own executable is Python."""
    # Other subcommands start faster without these.
    import shutil
    import sysconfig

    script = shutil.which("pointillist", path=sysconfig.get_path("scripts"))
    if script and "POINTILLIST_PROGRAM" not in os.environ:
        os.environ["POINTILLIST_PROGRAM"] = script
        # The script stays the same when the library that it loads is built anew.
        os.environ.setdefault("POINTILLIST_LIBRARY", str(_native.__file__))


def main() -> int:
    """Runs the program with the words of the command line, and returns its exit code."""
    if sys.argv[1:2] == ["regress"]:
        _name_program()
    # Ctrl-C is the program's: the first one ends a render with the picture so far.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.command(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
