"""``python -m cdprcal``, and the program ``cdprcal``: the command line."""

from __future__ import annotations

import sys

# Not "from cdprcal import …", which asks the core for names.
from cdprcal.interrupt import INTERRUPTED, watch


def main() -> None:
    """Runs the command line; Ctrl-C says so in one line at any time, other signals clean up."""
    watch()
    from cdprcal.streams import exit_code
    from cdprcal.streams import watch as watch_streams

    watch_streams()
    try:
        from cdprcal.cli import app

        app()
    except SystemExit as ended:
        sys.exit(exit_code(ended.code))
    except KeyboardInterrupt:  # after the command: while it runs it sees to this itself
        sys.stderr.write("cdprcal: interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
