"""
The registry of controllers: a protection and an operation, each one file and one line here.

A protection or operation is built from the world and an options dataclass, whose fields are
the keys that a scenario file may set.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from functools import partial
from typing import Any, NamedTuple, TypeAlias

from controllers.drive import TractionDrive
from controllers.operation.close_up import CloseUp, CloseUpOptions
from controllers.operation.two_stage import TwoStage, TwoStageOptions
from controllers.options import OptionError
from controllers.protection.moving_block import MovingBlock, MovingBlockOptions
from railway.control import Controller, Operation, Protection
from railway.scenario import ControllerSpec
from railway.world import World

__all__ = ["OPERATIONS", "PROTECTIONS", "ControllerError", "build", "options_of"]


class Layer(NamedTuple):
    """How to build a protection or an operation."""

    build: Callable[[World, Any], Any]
    options: type[Any]
    summary: str


Registry: TypeAlias = Mapping[str, Layer]

PROTECTIONS: Registry = {
    "moving_block": Layer(
        MovingBlock, MovingBlockOptions, "up to the leader's rear, taken as standing"
    ),
}

OPERATIONS: Registry = {
    "close_up": Layer(CloseUp, CloseUpOptions, "as fast as the authority allows"),
    "two_stage": Layer(
        TwoStage, TwoStageOptions, "two-stage deceleration with pre-deceleration (Sato 2025)"
    ),
    "two_stage_plain": Layer(
        partial(TwoStage, pre_deceleration=False),
        TwoStageOptions,
        "two-stage deceleration without pre-deceleration (Sato 2025)",
    ),
}


class ControllerError(ValueError):
    """A controller that cannot be built: which key, what is wrong, what is allowed."""

    def __init__(self, where: str, problem: str, allowed: str) -> None:
        super().__init__(f"{where}: {problem}; allowed: {allowed}")
        self.where = where
        self.problem = problem
        self.allowed = allowed


def build(spec: ControllerSpec, world: World) -> Controller:
    """
    Build a controller.

    Parameters
    ----------
    spec
        Names and options of its layers.
    world
        The line and its trains.

    Returns
    -------
    Controller
        Protection, operation and drive.

    Raises
    ------
    ControllerError
        If a layer or an option is unknown, or an option's value is not allowed.
    """
    where = f"controllers.{spec.name}"
    protection: Protection[Any] = _build_layer(
        PROTECTIONS, f"{where}.protection", spec.protection, spec.protection_options, world
    )
    operation: Operation[Any] = _build_layer(
        OPERATIONS, f"{where}.operation", spec.operation, spec.operation_options, world
    )
    return Controller(spec.name, protection, operation, TractionDrive(world))


def options_of(spec: ControllerSpec) -> dict[str, dict[str, float]]:
    """
    Return all options of a controller that can be built, defaults included.

    Parameters
    ----------
    spec
        Names and options of its layers.

    Returns
    -------
    dict[str, dict[str, float]]
        Options by layer.
    """
    return {
        "protection": asdict(PROTECTIONS[spec.protection].options(**spec.protection_options)),
        "operation": asdict(OPERATIONS[spec.operation].options(**spec.operation_options)),
    }


def _build_layer(
    registry: Registry, where: str, name: str, options: Mapping[str, float], world: World
) -> Any:  # noqa: ANN401 - each layer has its own memory type
    if name not in registry:
        raise ControllerError(
            where=where, problem=f"{name!r} is not known", allowed=", ".join(registry)
        )
    layer = registry[name]
    known = [field.name for field in fields(layer.options)]
    for key in options:
        if key not in known:
            problem = f"option {key!r} is not known to {name}"
            allowed = ", ".join(known) or "none"
            raise ControllerError(where=f"{where}_options.{key}", problem=problem, allowed=allowed)
    try:
        chosen = layer.options(**options)
    except OptionError as error:
        raise ControllerError(
            where=f"{where}_options", problem=error.problem, allowed=error.allowed
        ) from error
    return layer.build(world, chosen)
