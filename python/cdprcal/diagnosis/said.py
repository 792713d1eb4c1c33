"""A diagnosis in one line, while a run goes on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def in_words(told: Mapping[str, Any]) -> str:
    """One line for people of ``verdict``, ``faults`` and ``effects``, as logs have them."""
    said = [*told["faults"]]
    for effect in told["effects"]:
        alike = f", or {', '.join(effect['rivals'])}" if effect["rivals"] else ""
        said.append(f"{effect['name']} ({effect['log_evidence']:.0f} nats{alike})")
    return f"{told['verdict']}: {'; '.join(said) or 'no effect found'}"
