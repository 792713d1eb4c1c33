"""Static workspaces as documents, tables and pictures; ``cdprcal.compute_workspace`` makes them."""

from cdprcal.workspace.document import workspace_as_dict

__all__ = ["workspace_as_dict"]
