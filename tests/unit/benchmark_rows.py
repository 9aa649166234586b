"""Runs of a benchmark that nobody has run."""

from typing import Any

from kankaku.studies.benchmark_suites import REFERENCE, WORLDS

OWN = "moving_block+own"


def rows(seeds: tuple[int, ...] = (1, 2)) -> list[dict[str, Any]]:
    """Return the same figures for the reference and somebody else."""
    return [
        {
            "controller": controller,
            "suite": "branch",
            "world": world,
            "seed": seed,
            "trains": 10,
            "trains_completed": 10,
            "interstation_stop_time_s": 100.0 * seed,
            "mean_arrival_lateness_s": 40.0,
            "energy_net_kwh": 1000.0,
            "violations": 0,
            "train_steps": 10000,
            "tables_sha256": "0",
            "failure": "",
            "processor_s": 1.0,
        }
        for controller in (REFERENCE, OWN)
        for world in WORLDS
        for seed in seeds
    ]


def changed(
    runs: list[dict[str, Any]],
    controller: str,
    world: str = "",
    seed: int = 0,
    **figures: object,
) -> list[dict[str, Any]]:
    """Return runs where some of a controller have other figures."""
    return [
        {**run, **figures}
        if run["controller"] == controller
        and run["world"] == (world or run["world"])
        and run["seed"] == (seed or run["seed"])
        else run
        for run in runs
    ]
