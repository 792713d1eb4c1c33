"""A page on which effects are switched on and off, and poses left out, while one watches."""

from cdprcal.explore.exploration import Exploration
from cdprcal.explore.server import ExploreServer

__all__ = ["Exploration", "ExploreServer"]
