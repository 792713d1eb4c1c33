"""Studies: the same calculation many times over, on all cores or on a Dask cluster.

``spread`` runs any function over many items (``stream`` gives each result when it is there);
``start_ups`` (Monte Carlo), ``workspaces`` and ``plans`` are studies made of it, and ``vary`` makes
the robots that they compare. As a program: ``python -m cdprcal.studies --help``. Results do not
depend on where they were calculated.
"""

from cdprcal.studies.families import PlanRow, WorkspaceRow, plans, workspaces
from cdprcal.studies.monte_carlo import StartUpRow, coverage, start_ups
from cdprcal.studies.variants import variants, vary
from cdprcal.studies.workers import Workers, add_worker_options, spread, stream, workers_of

__all__ = [
    "PlanRow",
    "StartUpRow",
    "Workers",
    "WorkspaceRow",
    "add_worker_options",
    "coverage",
    "plans",
    "spread",
    "start_ups",
    "stream",
    "variants",
    "vary",
    "workers_of",
    "workspaces",
]
