"""What geometry found, as document and table; ``cdprcal.geometry`` finds it."""

from cdprcal.frame.document import frame_as_dict

__all__ = ["frame_as_dict"]
