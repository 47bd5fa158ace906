"""The dataset engine over a Ray cluster: ``pip install catseye[ray]``.

Each task makes one shard and changes nothing else, so a task that failed can run again, and the files are those of a run on one
machine. All machines need the recipe and the output folder under the same paths.

>>> import catseye.ray                                    # doctest: +SKIP
>>> catseye.ray.dataset("recipe.toml", "/shared/data")    # doctest: +SKIP
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from typing import Any

import ray

from . import _catseye

__all__ = ["dataset"]


def _shard(recipe: str, out: str, shards: tuple[int, int] | None, options: dict[str, Any]) -> dict[str, Any]:
    report: dict[str, Any] = _catseye.dataset(recipe, out, shards=shards, **options)
    return report


def dataset(
    recipe: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    shards: tuple[int, int] | None = None,
    device: str = "auto",
    in_flight: int | None = None,
    retries: int = 3,
    cpus: float = 1,
    gpus: float = 0,
    seed: int | None = None,
    mixed_devices: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Makes the missing shards of a dataset, one task per shard. After an interruption, the same call resumes.

    recipe, out: as for :func:`catseye.dataset`, under the same paths on every machine. shards: (first, end) of the shards to make, default all.
    device: as for :class:`catseye.Engine`, on each worker. in_flight: number of tasks that are submitted at a time, default twice the number that the
    cluster can run at once. retries: number of times that a task runs again whose worker died or whose machine failed; bad input is never tried
    again. cpus, gpus: resources that Ray reserves for a task; it uses as many threads as ``cpus``. seed: replaces the recipe's seed. mixed_devices:
    workers may have different kinds of devices. progress: called with the number of shards done and the total.

    Starts Ray on this machine where no cluster is connected (``ray.init``). Returns the report of :func:`catseye.dataset`. Raises BadInput and Failed
    as that function does, and Ray's error where a task failed too often.
    """
    recipe, out = os.path.abspath(recipe), os.path.abspath(out)
    facts = _catseye.recipe_facts(recipe, seed=seed)
    first, end = (0, int(facts["shards"])) if shards is None else shards
    # A range that the recipe does not have is refused by the first task.
    numbers = list(range(first, end)) or [first]
    if not ray.is_initialized():
        ray.init(log_to_driver=False)
    if in_flight is None:
        in_flight = 2 * max(1, int(min(_fits("CPU", cpus), _fits("GPU", gpus), len(numbers))))
    if in_flight < 1 or retries < 0:
        raise _catseye.BadInput("in_flight is 1 or more, and retries 0 or more")
    options: dict[str, Any] = {"engine": device, "seed": seed, "mixed_devices": mixed_devices, "jobs": 1}
    threads = {"RAYON_NUM_THREADS": str(max(1, int(cpus)))}
    task = ray.remote(_shard).options(
        name="catseye shard",
        num_cpus=cpus,
        num_gpus=gpus,
        max_retries=retries,
        retry_exceptions=[_catseye.Failed],
        runtime_env={"env_vars": threads},
    )

    waiting = deque(numbers)
    running: dict[Any, int] = {}
    done = 0
    try:
        while waiting or running:
            # The first task lays out the folder; the others find it.
            most = in_flight if done else 1
            while waiting and len(running) < most:
                shard = waiting.popleft()
                running[task.remote(recipe, out, (shard, shard + 1), options)] = shard
            finished, _ = ray.wait(list(running), num_returns=1)
            for reference in finished:
                del running[reference]
                _result(reference)
                done += 1
                if progress is not None:
                    progress(done, len(numbers))
        # All is there: this run makes nothing but manifest and datasheet, or finds that other shards are missing.
        return _result(task.remote(recipe, out, shards, options))
    except BaseException:
        for reference in running:
            ray.cancel(reference)
        if running:
            ray.wait(list(running), num_returns=len(running), timeout=60)
        raise


def _fits(resource: str, each: float) -> float:
    """Number of tasks that the cluster can run at once."""
    available: dict[str, float] = ray.cluster_resources()  # type: ignore[no-untyped-call,unused-ignore]
    return available.get(resource, 0.0) / each if each > 0 else float("inf")


def _result(reference: Any) -> dict[str, Any]:
    try:
        report: dict[str, Any] = ray.get(reference)
        return report
    except ray.exceptions.RayTaskError as e:
        # As the library raised it, not wrapped.
        if isinstance(e.cause, (_catseye.BadInput, _catseye.Failed)):
            raise e.cause from None
        raise
