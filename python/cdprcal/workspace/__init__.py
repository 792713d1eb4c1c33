"""Static workspaces as documents, tables and pictures; ``cdprcal.compute_workspace`` makes them."""

from cdprcal.workspace.document import workspace_as_dict
from cdprcal.workspace.steps import round_step_m

__all__ = ["round_step_m", "workspace_as_dict"]
