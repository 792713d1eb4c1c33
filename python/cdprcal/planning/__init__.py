"""Measurement plans as documents, tables and pictures; ``cdprcal.make_plan`` makes them."""

from cdprcal.planning.document import plan_as_dict

__all__ = ["plan_as_dict"]
