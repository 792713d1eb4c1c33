"""The letters of the locale: what a text becomes where it is not one of Unicode.

Apart from ``terminal``, whose library of tables is slow to load: help and errors
need letters alone.
"""

from __future__ import annotations

import locale
import os

#: What is written for a letter that an ASCII terminal lacks; None of them is left out.
_ASCII = {
    "±": "+-",
    "°": " deg",
    "σ": "sigma",
    "τ": "tau",
    "ε": "eps",
    "μ": "mu",
    "χ": "chi",
    "Δ": "delta",
    "×": "x",
    "·": "*",
    "²": "2",
    "³": "3",
    "–": "-",
    "\N{MINUS SIGN}": "-",
    "…": "...",
    "→": "->",
    "≤": "<=",
    "≥": ">=",
    "′": "'",
    "é": "e",
}
_TO_ASCII = str.maketrans(_ASCII)


def speaks_unicode() -> bool:
    """Whether the locale does; POSIX's own (``LC_ALL=C``) promises ASCII alone."""
    chosen = next(filter(None, map(os.environ.get, ("LC_ALL", "LC_CTYPE", "LANG"))), "C")
    if chosen in ("C", "POSIX"):
        return False
    return "utf" in (chosen + locale.getpreferredencoding(False)).lower()


def readable(text: str) -> str:
    """The text as the locale can show it: µ, ±, σ and the like in ASCII where it must be."""
    return text if speaks_unicode() else text.translate(_TO_ASCII)
