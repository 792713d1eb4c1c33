"""cdprcal: where a cable robot hangs when it is switched on.

The names of the C++ core are available here directly (``cdprcal.load_robot``, ``cdprcal.Pose``,
``cdprcal.calibrate``, …). They are loaded on first use, so that the command line starts quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdprcal._core import *  # noqa: F403


def __getattr__(name: str) -> Any:
    if not name.startswith("_"):
        from cdprcal import _core

        if hasattr(_core, name):
            return getattr(_core, name)
    raise AttributeError(f"module 'cdprcal' has no attribute {name!r}")


def __dir__() -> list[str]:
    from cdprcal import _core

    return sorted({*globals(), *(name for name in dir(_core) if not name.startswith("_"))})
