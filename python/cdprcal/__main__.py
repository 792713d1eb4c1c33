"""``python -m cdprcal``: the command line."""

from cdprcal.cli import main

if __name__ == "__main__":
    main()
