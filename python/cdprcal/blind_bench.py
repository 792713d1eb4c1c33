"""``python -m cdprcal.blind_bench``: the blind bench, by its short name."""

from cdprcal.testing.blind_bench.__main__ import app

if __name__ == "__main__":
    app()
