"""Static workspaces as documents, tables and pictures; ``cdprcal.compute_workspace`` makes them."""

from cdprcal.workspace.document import round_step_m, workspace_as_dict

__all__ = ["round_step_m", "workspace_as_dict"]
