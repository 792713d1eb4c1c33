"""Standard deviations of covariances."""

from __future__ import annotations

from typing import Any

import numpy as np


def deviations(covariances: Any) -> Any:
    """Roots of the diagonals: [..., n, n] → [..., n]."""
    return np.sqrt(np.diagonal(covariances, axis1=-2, axis2=-1))
