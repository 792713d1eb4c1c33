"""cdprcal: where a cable robot hangs when it is switched on.

The names of the C++ core are available here directly (``cdprcal.load_robot``, ``cdprcal.Pose``, …),
and some as people write them, with paths and words (``cdprcal.calibrate("irma4", "run.csv")``).
They are loaded on first use, so that the command line starts quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # The names that come first count for type checkers.
    from cdprcal.calls import calibrate as calibrate
    from cdprcal.calls import diagnose as diagnose
    from cdprcal.calls import geometry as geometry
    from cdprcal.calls import simulate_startup as simulate_startup
    from cdprcal.calls import track as track

    from cdprcal._core import *  # type: ignore[assignment]  # noqa: F403  # isort: skip

#: What takes paths and words, in place of the core's functions of that name.
_CALLS = ("calibrate", "diagnose", "geometry", "simulate_startup", "track")


__version__: str


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return globals().setdefault(name, version("cdprcal"))
    if name == "__all__":  # asked for by import *, which would find nothing of what is lazy
        return globals().setdefault(name, _public())
    if not name.startswith("_"):
        import cdprcal.copying  # noqa: F401  options are copied so, whatever is asked for
        from cdprcal import _core

        if name in _CALLS:
            from cdprcal import calls

            return globals().setdefault(name, getattr(calls, name))
        if hasattr(_core, name):
            from cdprcal.signatures import signed

            return globals().setdefault(name, signed(name))
    raise AttributeError(f"module 'cdprcal' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_public()})


def _public() -> list[str]:
    """All names that people use."""
    from cdprcal import _core

    return sorted({*_CALLS, *(name for name in dir(_core) if not name.startswith("_"))})
