"""
The registry of layers: protections, operations and supervisions, each one file and one line here.

A layer is built from the world and an options dataclass, whose fields are the keys that a scenario
file may set.
"""

from collections.abc import Callable, Iterable
from dataclasses import asdict, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from kankaku.controllers.centre.over_radio import OverRadio
from kankaku.controllers.chosen_layer import choose_layer, likely
from kankaku.controllers.control_map.map_operation import FollowPlan, FollowPlanOptions
from kankaku.controllers.control_map.map_protection import ControlMap, ControlMapOptions
from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.eco_layer.eco_margin import EcoMargin, energy_of
from kankaku.controllers.layers import (
    ControllerError,
    Guarding,
    Layer,
    Medium,
    OperationFactory,
    PluginError,
    ProtectionFactory,
    RadioFactory,
    Registry,
    SupervisionFactory,
)
from kankaku.controllers.operation.approach_point import ApproachPointControl, ApproachPointOptions
from kankaku.controllers.operation.close_up import CloseUp, CloseUpOptions
from kankaku.controllers.operation.eco import Eco, EcoOptions
from kankaku.controllers.operation.two_stage import TwoStage, TwoStageOptions
from kankaku.controllers.options import OptionError
from kankaku.controllers.peers import PEERS, build_peer
from kankaku.controllers.protection.atd import Atd, AtdOptions
from kankaku.controllers.protection.digital_atc import DigitalAtc, DigitalAtcOptions
from kankaku.controllers.protection.moving_block import MovingBlock, MovingBlockOptions
from kankaku.controllers.protection.multi_step_atc import MultiStepAtc, MultiStepAtcOptions
from kankaku.controllers.protection.relative_braking import RelativeBraking, RelativeBrakingOptions
from kankaku.controllers.stochastic.approach_options import StochasticApproachOptions
from kankaku.controllers.stochastic.stochastic_approach import StochasticApproach
from kankaku.controllers.supervision.headway_regulation import (
    HeadwayRegulation,
    HeadwayRegulationOptions,
)
from kankaku.controllers.supervision.hold_for_clear_way import (
    HoldForClearWay,
    HoldForClearWayOptions,
)
from kankaku.controllers.supervision.no_supervision import NoSupervisionOptions, nobody
from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import KankakuError, sentence_of
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec, keeps_pace
from kankaku.railway.plan.scenario import UNSUPERVISED, ControllerSpec, Option
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller, Operation, Supervision

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from kankaku.controllers.centre.over_radio import Centre

__all__ = [
    "OPERATIONS",
    "PEERS",
    "PROTECTIONS",
    "SUPERVISIONS",
    "ControllerError",
    "Layer",
    "Medium",
    "Registry",
    "build",
    "choose_layer",
    "likely",
    "options_of",
    "warnings",
]


PROTECTIONS = Registry(
    "protection",
    "kankaku.protections",
    {
        "moving_block": Layer(
            MovingBlock,
            MovingBlockOptions,
            "up to the leader's rear, taken as standing",
            Medium.EITHER,
        ),
        "multi_step_atc": Layer(
            MultiStepAtc, MultiStepAtcOptions, "a speed code per block by the free blocks ahead"
        ),
        "atd": Layer(
            Atd, AtdOptions, "one braking curve over the same blocks, as a fine staircase"
        ),
        "digital_atc": Layer(
            DigitalAtc,
            DigitalAtcOptions,
            "one brake pattern worked out on board, to a stop point over the same circuits",
        ),
        "relative_braking": Layer(
            RelativeBraking,
            RelativeBrakingOptions,
            "counts on the leader's braking distance: NOT safe if a leader derails or collides",
            Medium.EITHER,
        ),
        "control_map": Layer(
            ControlMap,
            ControlMapOptions,
            "a centre plans bands that do not overlap and commands trains by radio (Sugiyama 2018)",
            Medium.RADIO,
        ),
    },
)

OPERATIONS = Registry(
    "operation",
    "kankaku.operations",
    {
        "close_up": Layer(CloseUp, CloseUpOptions, "as fast as the authority allows"),
        "two_stage": Layer(
            TwoStage, TwoStageOptions, "two-stage deceleration with pre-deceleration (Sato 2025)"
        ),
        "two_stage_plain": Layer(
            partial(TwoStage, pre_deceleration=False),
            TwoStageOptions,
            "two-stage deceleration without pre-deceleration (Sato 2025)",
        ),
        "approach_point": Layer(
            ApproachPointControl,
            ApproachPointOptions,
            "passes the approach point when the way becomes free (Sakai 2020)",
        ),
        "stochastic_approach": Layer(
            StochasticApproach,
            StochasticApproachOptions,
            "by the least cost to come while a leader may leave its platform at any moment",
        ),
        "clairvoyant": Layer(
            StochasticApproach,
            StochasticApproachOptions,
            "the same, told when leaders will depart: for comparison only",
            knows_future=True,
        ),
        "eco": Layer(
            Eco, EcoOptions, "arrives at the booked time with the least energy (Kawashima 1991)"
        ),
        "control_map": Layer(
            FollowPlan, FollowPlanOptions, "as the centre of a control map commands"
        ),
    },
)

SUPERVISIONS = Registry(
    "supervision",
    "kankaku.supervisions",
    {
        UNSUPERVISED: Layer(nobody, NoSupervisionOptions, "trains leave when their stops are over"),
        "hold_for_clear_way": Layer(
            HoldForClearWay,
            HoldForClearWayOptions,
            "holds a train until it can run to its next platform without standing",
        ),
        "headway_regulation": Layer(
            HeadwayRegulation,
            HeadwayRegulationOptions,
            "holds a train until it is midway between its neighbours (Cats et al. 2011)",
        ),
    },
)

Made = TypeVar("Made")
OPERATION_PARTS = ("reasons", "initial", "advise")
SUPERVISION_PARTS = ("initial", "supervise")
PROTECTION_PARTS = (
    *("separation", "promises", "initial", "authorise", "profile", "delay_s", "release_delay_s"),
    *("idle_time_s", "sighting_time_s", "eoa_behind_m", "permitted_mps"),
)
"""What whoever runs a layer calls; see :mod:`kankaku.railway.step.control`."""


def build(
    spec: ControllerSpec,
    world: World,
    radio: RadioSpec = LOSSLESS,
    delays_s: FloatArray | None = None,
) -> Controller:
    """
    Build a controller.

    Parameters
    ----------
    spec
        Names and options of its layers.
    world
        The line and its trains.
    radio
        What commands go by that go by radio.
    delays_s
        The drawn dwell delays, for operations that know the future; nobody overstays where None.
        [s], shape (n_trains, n_calls_max)

    Returns
    -------
    Controller
        Protection, operation, drive and supervision.

    Raises
    ------
    ControllerError
        If a layer or an option is unknown, an option's value is not allowed, or the radio does
        not keep pace with the steps.
    PluginError
        If a layer of another package cannot be built.
    """
    # No name in a file has a plus sign: that one comes from the command line.
    where = f"--controller {spec.name}" if "+" in spec.name else f"controllers.{spec.name}"
    world = world.driven_as(spec.driving)
    if spec.peer is not None:
        if spec.supervision != UNSUPERVISED:
            problem = f"{spec.peer!r} drives its trains itself: nobody can hold them at platforms"
            raise ControllerError(
                where=f"{where}.supervision", problem=problem, allowed=UNSUPERVISED
            )
        try:
            return build_peer(spec.name, spec.peer, world)
        except OptionError as error:
            raise ControllerError(
                where=f"{where}.peer", problem=error.problem, allowed=error.allowed
            ) from error
    energy, usual = energy_of(spec, where), world
    if energy is not None and energy.eco_reserve:
        # The plan, not the driver, spends the reserve.
        world = world.driven_as(world.driving.at_limits)
    protection = _protection(spec, world, radio, where)
    operation = _operation(spec, world, protection, where, delays_s)
    if energy is not None:
        operation = EcoMargin(operation, world, usual, energy, protection)
    return Controller(
        spec.name,
        protection,
        operation,
        TractionDrive(world),
        protection.separation,
        by_radio=_goes_by_radio(spec),
        promises=protection.promises,
        supervision=_supervision(spec, world, where),
    )


def _operation(
    spec: ControllerSpec,
    world: World,
    protection: Guarding,
    where: str,
    delays_s: FloatArray | None,
) -> Operation[Any]:
    layer, options = choose_layer(
        OPERATIONS, f"{where}.operation", spec.operation, spec.operation_options
    )
    make = cast("OperationFactory", layer.build)
    if layer.knows_future:
        told_s = np.zeros_like(world.minimum_dwell_s[:, :-1]) if delays_s is None else delays_s
        world = replace(world, foretold_delay_s=told_s)
    return _made(
        OPERATIONS, spec.operation, lambda: make(world, options, protection), OPERATION_PARTS
    )


def _supervision(spec: ControllerSpec, world: World, where: str) -> Supervision[Any] | None:
    layer, options = choose_layer(
        SUPERVISIONS, f"{where}.supervision", spec.supervision, spec.supervision_options
    )
    make = cast("SupervisionFactory", layer.build)
    return _made(SUPERVISIONS, spec.supervision, lambda: make(world, options), SUPERVISION_PARTS)


def _made(registry: Registry, name: str, make: Callable[[], Made], parts: tuple[str, ...]) -> Made:
    """Build a layer; a mistake in another package is told as that package's."""
    package = registry.package_of(name)
    where = f"{registry.kind} {name!r} of {package}"
    try:
        made = make()
    except KankakuError:
        raise
    except Exception as error:
        if not package:
            raise
        raise PluginError(where, sentence_of(error), "one that can be built") from error
    missing = [part for part in parts if package and not hasattr(made, part)]
    if missing:
        raise PluginError(where, f"has no {', '.join(missing)}", f"one with {', '.join(parts)}")
    return made


def _goes_by_radio(spec: ControllerSpec) -> bool:
    return spec.radio or PROTECTIONS[spec.protection].medium is Medium.RADIO


def _protection(spec: ControllerSpec, world: World, radio: RadioSpec, where: str) -> Guarding:
    layer, options = choose_layer(
        PROTECTIONS, f"{where}.protection", spec.protection, spec.protection_options
    )
    if spec.radio and layer.medium is Medium.TRACK:
        raise ControllerError(
            where=f"{where}.radio",
            problem=f"the commands of {spec.protection} go through the track",
            allowed=", ".join(
                name for name, other in PROTECTIONS.items() if other.medium is not Medium.TRACK
            ),
        )
    if _goes_by_radio(spec) and not keeps_pace(radio.cycle_s, world.step_s):
        raise ControllerError(
            where=f"{where}.radio",
            problem=f"half a cycle of {radio.cycle_s:g} s is no multiple of the step",
            allowed=f"steps that divide {0.5 * radio.cycle_s:g} s, unlike {world.step_s:g} s",
        )
    try:
        protection = _made(
            PROTECTIONS,
            spec.protection,
            lambda: _guarding(layer, world, options, radio),
            PROTECTION_PARTS,
        )
    except OptionError as error:
        raise ControllerError(
            where=f"{where}.protection", problem=error.problem, allowed=error.allowed
        ) from error
    if spec.radio and layer.medium is Medium.EITHER:
        return OverRadio(cast("Centre", protection), world, radio)
    return protection


def _guarding(
    layer: Layer, world: World, options: "DataclassInstance", radio: RadioSpec
) -> Guarding:
    if layer.medium is Medium.RADIO:
        return cast("RadioFactory", layer.build)(world, options, radio)
    return cast("ProtectionFactory", layer.build)(world, options)


def warnings(
    specs: Iterable[ControllerSpec], world: World, radio: RadioSpec = LOSSLESS
) -> tuple[str, ...]:
    """
    Return what is allowed but doubtful in some controllers on a line.

    Parameters
    ----------
    specs
        The controllers.
    world
        The line and its trains.
    radio
        What commands go by that go by radio.

    Returns
    -------
    tuple[str, ...]
        Sentences, with the names of the controllers that they hold for.

    Raises
    ------
    ControllerError
        If a controller that could be doubtful cannot be built.
    """
    names: dict[str, list[str]] = {}
    for spec in specs:
        layer = PROTECTIONS.get(spec.protection)
        # What has nothing to say need not be built for that.
        if layer is not None and hasattr(layer.build, "warnings"):
            protection: Any = build(spec, world, radio).protection
            for sentence in protection.warnings():
                names.setdefault(sentence, []).append(spec.name)
        for sentence in (
            PROTECTIONS.overruled(spec.protection),
            OPERATIONS.overruled(spec.operation),
            SUPERVISIONS.overruled(spec.supervision),
        ):
            if sentence:
                names.setdefault(sentence, []).append(spec.name)
    return tuple(f"{', '.join(alike)}: {sentence}" for sentence, alike in names.items())


def options_of(spec: ControllerSpec) -> dict[str, dict[str, Option]]:
    """
    Return all options of a controller that can be built, defaults included.

    Parameters
    ----------
    spec
        Names and options of its layers.

    Returns
    -------
    dict[str, dict[str, Option]]
        Options by layer; a peer has none, nor has a supervision that is none.
    """
    if spec.peer is not None:
        return {}
    told = {
        "protection": asdict(PROTECTIONS[spec.protection].options(**spec.protection_options)),
        "operation": asdict(OPERATIONS[spec.operation].options(**spec.operation_options)),
    }
    if spec.supervision != UNSUPERVISED:
        options = SUPERVISIONS[spec.supervision].options(**spec.supervision_options)
        told["supervision"] = asdict(options)
    energy = energy_of(spec, f"controllers.{spec.name}")
    return told if energy is None else {**told, "energy": asdict(energy)}
