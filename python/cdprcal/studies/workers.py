"""One function over many items: in this process, on all cores, or on a Dask cluster."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from types import ModuleType
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from cdprcal._core import InputError
from cdprcal.extras import need

Item = TypeVar("Item")
Result = TypeVar("Result")

#: Dask's workers on this computer, as many as it has cores.
LOCAL = "local"
_CHUNKS_A_WORKER = 8
_CONNECT_S = 10


@dataclass(frozen=True)
class Workers:
    """Who calculates: ``jobs`` processes here (0: one a core; 1: this one), or a Dask cluster.

    ``dask`` is the address of a scheduler (tcp://…), or "local" for a cluster on this computer;
    it needs the extra ``dask``.
    """

    jobs: int = 0
    dask: str = ""

    def __post_init__(self) -> None:
        if self.jobs < 0:
            raise InputError(f"jobs: {self.jobs}; give a number of processes, or 0 for all cores")

    @property
    def processes(self) -> int:
        """The processes that ``jobs`` means on this computer."""
        return self.jobs or len(os.sched_getaffinity(0))


def spread(
    work: Callable[[Item], Result], items: Sequence[Item], workers: Workers | None = None
) -> list[Result]:
    """work(item) for each item, in their order: the same to the bit whoever calculates it.

    ``work`` and the items must be picklable: a function of a module, perhaps with
    functools.partial, and plain data, robots or poses. An exception of ``work`` is raised here.
    Raises InputError when Dask is not installed or no scheduler answers.
    """
    workers = workers or Workers()
    items = list(items)
    if workers.dask:
        return _on_dask(work, items, workers)
    count = min(workers.processes, len(items))
    if count <= 1:
        return _each(work, items)
    chunks = _chunks(items, count)
    # Not forked: threads of libraries do not survive that.
    with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
        return [result for part in pool.map(partial(_each, work), chunks) for result in part]


def stream(
    work: Callable[[Item], Result], items: Sequence[Item], workers: Workers | None = None
) -> Generator[Result, None, None]:
    """As spread on this computer, but each result as soon as it and those before it are there:
    for a study that is written down as it goes. Whoever stops taking ends the rest.
    """
    workers = workers or Workers()
    count = min(workers.processes, len(items))
    if count <= 1:
        for item in items:
            yield from _each(work, [item])
        return
    pool = ProcessPoolExecutor(count, mp_context=get_context("spawn"))
    try:
        for part in pool.map(partial(_each, work), [[item] for item in items]):
            yield from part
    finally:
        pool.shutdown(cancel_futures=True)


def _each(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    # numpy's linear algebra rounds differently on one thread and on two, and the cores are taken.
    with threadpool_limits(limits=1):
        return [work(item) for item in items]


def _chunks(items: list[Item], workers: int) -> list[list[Item]]:
    """Several a worker, so that none waits long for the last one."""
    size = max(1, len(items) // (_CHUNKS_A_WORKER * workers))
    return [items[i : i + size] for i in range(0, len(items), size)]


def _on_dask(work: Callable[[Item], Result], items: list[Item], workers: Workers) -> list[Result]:
    with _client(workers) as client, _travelling(work):
        count = max(1, sum(client.nthreads().values()))
        # Not pure: a function of the same name may be another one tomorrow.
        futures = client.map(partial(_each, work), _chunks(items, count), pure=False)
        return [result for part in client.gather(futures) for result in part]


@contextmanager
def _client(workers: Workers) -> Iterator[Any]:
    need("distributed")
    distributed = importlib.import_module("distributed")
    if workers.dask == LOCAL:
        with (
            distributed.LocalCluster(
                n_workers=workers.processes, threads_per_worker=1, dashboard_address=None
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = distributed.Client(workers.dask, timeout=_CONNECT_S)
    except (OSError, ValueError) as error:
        raise InputError(
            f"dask: {workers.dask}: no scheduler answers ({error}): start one with 'dask "
            "scheduler', and workers with 'dask worker ADDRESS --nthreads 1'"
        ) from None
    with client:
        yield client


@contextmanager
def _travelling(work: Callable[..., Any]) -> Iterator[None]:
    """A script's own functions travel as code: its workers need not have the file.

    What is installed (cdprcal itself, numpy) is imported there.
    """
    cloudpickle = importlib.import_module("cloudpickle")
    function: Any = work
    while isinstance(function, partial):
        function = function.func
    module = sys.modules.get(getattr(function, "__module__", ""))
    registered = module is not None and _is_loose(module)
    if registered:
        cloudpickle.register_pickle_by_value(module)
    try:
        yield
    finally:
        if registered:
            cloudpickle.unregister_pickle_by_value(module)


def _is_loose(module: ModuleType) -> bool:
    """A file of its own beside a script, no part of a package."""
    return module.__name__ != "__main__" and "." not in module.__name__ and not module.__package__


def add_worker_options(parser: argparse.ArgumentParser) -> None:
    """``--jobs`` and ``--dask`` of a study that is a script."""
    parser.add_argument(
        "--jobs", type=int, default=0, help="processes; 0 (the default): one a core"
    )
    parser.add_argument(
        "--dask",
        nargs="?",
        const=LOCAL,
        default="",
        metavar="ADDRESS",
        help="on a Dask cluster instead: its scheduler (tcp://…); without ADDRESS one is started "
        "here",
    )


def workers_of(given: argparse.Namespace) -> Workers:
    """What ``add_worker_options`` was told."""
    return Workers(given.jobs, given.dask)
