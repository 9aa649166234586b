"""
Choosing controllers beyond those of a scenario: other layers, and other options.

``moving_block+eco`` is a protection and an operation with the defaults of their options, and
``moving_block+eco+headway_regulation`` has a supervision besides;
``two_stage.slowest_kmh=20`` gives an option of a controller another value.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, NamedTuple

from kankaku.controllers.eco_layer.eco_margin import energy_of
from kankaku.controllers.registry import (
    OPERATIONS,
    PROTECTIONS,
    SUPERVISIONS,
    ControllerError,
    Registry,
    choose_layer,
    likely,
)
from kankaku.railway.plan.scenario import UNSUPERVISED, ControllerSpec, Option

PLUS = "+"
"""Between the layers of a controller that no scenario names; no name in a file has it."""
CONTROLLER, SET = "--controller", "--set"
PROTECTION, OPERATION, SUPERVISION = "protection", "operation", "supervision"
RADIO, ECO_MARGIN, ECO_RESERVE = "radio", "eco_margin_s", "eco_reserve"
BESIDE = {RADIO: "true or false", ECO_MARGIN: "a number", ECO_RESERVE: "true or false"}
"""What can be set of a controller beside the options of its layers, and to what."""
_VALUES = "a finite number, true or false, or a list of finite numbers, as in scenario.toml"
SHOWN = 40
"""Characters of a value that a complaint shows."""
_FORM = "<controller>.<option>=<value>"


def foretold(specs: Iterable[ControllerSpec]) -> frozenset[str]:
    """
    Return which controllers are told the drawn dwell delays: for comparison only.

    Parameters
    ----------
    specs
        Controllers that can be built.

    Returns
    -------
    frozenset[str]
        Names of those whose operation knows the future.
    """
    return frozenset(
        spec.name for spec in specs if spec.peer is None and OPERATIONS[spec.operation].knows_future
    )


def named(specs: Sequence[ControllerSpec], name: str) -> ControllerSpec:
    """
    Return a controller by its name, or by the names of its layers.

    Parameters
    ----------
    specs
        Controllers of the scenario.
    name
        One of theirs, ``protection+operation``, or ``protection+operation+supervision``.

    Returns
    -------
    ControllerSpec
        That of the scenario, or the layers with the defaults of their options.

    Raises
    ------
    ControllerError
        If there is no such controller or layer.
    """
    known = {spec.name: spec for spec in specs}
    if name in known:
        return known[name]
    if PLUS not in name:
        raise ControllerError(
            where=CONTROLLER,
            problem=f"{name!r} is not a controller of this scenario",
            allowed=f"{likely(name, known)}, or <protection>{PLUS}<operation>",
        )
    protection, _, rest = name.partition(PLUS)
    operation, plus, supervision = rest.partition(PLUS)
    supervision = supervision if plus else UNSUPERVISED
    for kind, layer, registry in (
        (PROTECTION, protection, PROTECTIONS),
        (OPERATION, operation, OPERATIONS),
        (SUPERVISION, supervision, SUPERVISIONS),
    ):
        if layer not in registry:
            problem = f"{name!r}: {layer!r} is not a known {kind}"
            raise ControllerError(CONTROLLER, problem, likely(layer, registry))
    return ControllerSpec(name, protection, operation, {}, {}, supervision=supervision)


def by_layers(name: str) -> ControllerSpec:
    """
    Return a controller that no scenario needs to name, with the defaults of its options.

    Parameters
    ----------
    name
        A protection (under ``close_up``), an operation (over ``moving_block``), a supervision
        (over both), ``protection+operation`` or ``protection+operation+supervision``; those of
        other packages, too.

    Returns
    -------
    ControllerSpec
        Named by its protection, its operation and, if there is one, its supervision.

    Raises
    ------
    ControllerError
        If there is no such layer.
    """
    if PLUS in name:
        return named((), name)
    layers = {PROTECTION: "moving_block", OPERATION: "close_up", SUPERVISION: ""}
    registries = (PROTECTIONS, OPERATIONS, SUPERVISIONS)
    kinds = [known.kind for known in registries if name in known]
    if not kinds or name == UNSUPERVISED:
        everything = dict.fromkeys(layer for known in registries for layer in known)
        problem = "is no protection, operation or supervision"
        allowed = f"{likely(name, everything)}, or one of a package that is installed"
        raise ControllerError(name, problem, allowed)
    layers[kinds[0]] = name
    if name in PROTECTIONS and name in OPERATIONS:
        # Layers of one name are made for each other.
        layers[OPERATION] = name
    return named((), PLUS.join(layer for layer in layers.values() if layer))


def with_settings(
    specs: Sequence[ControllerSpec], settings: Iterable[str]
) -> tuple[ControllerSpec, ...]:
    """
    Return controllers with other values of some options.

    Parameters
    ----------
    specs
        Controllers that are to run.
    settings
        ``<controller>.<option>=<value>`` each, the value as in ``scenario.toml``; the last one
        of an option counts. An option that several layers have is named with its layer, as in
        ``<controller>.protection.<option>``.

    Returns
    -------
    tuple[ControllerSpec, ...]
        The same names in the same order.

    Raises
    ------
    ControllerError
        If a setting has another form, or names no controller, option or value that is allowed.
    """
    changed = {spec.name: spec for spec in specs}
    for text in settings:
        key, equals, value = text.partition("=")
        name, option = _name_and_option(changed, key.strip())
        if not equals or not option:
            raise ControllerError(SET, f"{text!r} is no setting", _FORM)
        changed[name] = _set(changed[name], option, _value_of(key, value))
    return tuple(changed.values())


def _name_and_option(known: Mapping[str, ControllerSpec], key: str) -> tuple[str, str]:
    """Split a key; names of controllers may have dots themselves."""
    fitting = [name for name in known if key.startswith(f"{name}.")]
    if fitting:
        name = max(fitting, key=len)
        return name, key[len(name) + 1 :]
    if "." not in key:
        return "", ""
    problem = f"{key.rpartition('.')[0]!r} is not a controller that is to run"
    raise ControllerError(SET, problem, ", ".join(known))


def _value_of(key: str, text: str) -> Option:
    try:
        read = tomllib.loads(f"value = {text}")
        value = _option(read.pop("value")) if len(read) == 1 else None
    except (tomllib.TOMLDecodeError, OverflowError, RecursionError, ValueError):
        value = None
    if value is None:
        raise ControllerError(where=f"{SET}: {key}", problem=f"{text[:SHOWN]!r}", allowed=_VALUES)
    return value


def _option(value: object) -> Option | None:
    if isinstance(value, bool):
        return value
    if isinstance(value, int | float):
        return float(value) if math.isfinite(value) else None
    if not isinstance(value, list) or not value:
        return None
    numbers = [_option(part) for part in value]
    if all(isinstance(number, float) for number in numbers):
        return tuple(float(number) for number in numbers if isinstance(number, float))
    return None


class _Place(NamedTuple):
    """An option of a controller."""

    layer: str
    option: str


def _set(spec: ControllerSpec, key: str, value: Option) -> ControllerSpec:
    where = f"{SET}: {spec.name}.{key}"
    if spec.peer is not None:
        others = "controllers with a protection and an operation"
        raise ControllerError(where, f"{spec.name} is a peer, which has no options", others)
    if key in BESIDE:
        return _with_beside(spec, key, value, where)
    layer, option = _place_of(spec, key, where)
    registry, name, options = _layers(spec)[layer]
    options = {**options, option: value}
    try:
        # Here, so that nobody looks for the mistake in the scenario's file.
        choose_layer(registry, where, name, options)
    except ControllerError as error:
        raise ControllerError(where, error.problem, error.allowed) from error
    changed: dict[str, Any] = {f"{layer}_options": options}
    return replace(spec, **changed)


def _with_beside(spec: ControllerSpec, key: str, value: Option, where: str) -> ControllerSpec:
    if key == ECO_MARGIN and isinstance(value, float):
        changed = replace(spec, eco_margin_s=value)
        try:
            energy_of(changed, where)
        except ControllerError as error:
            raise ControllerError(where, error.problem, error.allowed) from error
        return changed
    if key != ECO_MARGIN and isinstance(value, bool):
        return replace(spec, radio=value) if key == RADIO else replace(spec, eco_reserve=value)
    raise ControllerError(where, f"{value!r}", BESIDE[key])


def _layers(spec: ControllerSpec) -> Mapping[str, tuple[Registry, str, Mapping[str, Option]]]:
    return {
        PROTECTION: (PROTECTIONS, spec.protection, spec.protection_options),
        OPERATION: (OPERATIONS, spec.operation, spec.operation_options),
        SUPERVISION: (SUPERVISIONS, spec.supervision, spec.supervision_options),
    }


def _place_of(spec: ControllerSpec, key: str, where: str) -> _Place:
    known = {
        layer: [field.name for field in fields(registry[name].options)]
        for layer, (registry, name, _) in _layers(spec).items()
        if name in registry
    }
    layer, dot, option = key.partition(".")
    found = [_Place(name, key) for name, options in known.items() if key in options]
    if dot and option in known.get(layer, ()):
        found = [_Place(layer, option)]
    if len(found) == 1:
        return found[0]
    if found:
        layers = " and ".join(place.layer for place in found)
        problem = f"{layers} have the option {key!r}"
        both = ", ".join(f"{spec.name}.{place.layer}.{key}" for place in found)
        raise ControllerError(where, problem, both)
    allowed = ", ".join([*(option for options in known.values() for option in options), *BESIDE])
    raise ControllerError(where, f"option {key!r} is not known to {spec.name}", allowed)


def changed_options(spec: ControllerSpec) -> dict[str, Option]:
    """
    Return the options of a controller that are not the defaults of its layers.

    Parameters
    ----------
    spec
        The controller.

    Returns
    -------
    dict[str, Option]
        By option; where several layers have one of that name, by layer and option.

    Raises
    ------
    ControllerError
        If a layer or an option is not allowed.
    """
    if spec.peer is not None:
        return {}
    found: dict[tuple[str, str], Option] = {}
    for layer, (registry, name, options) in _layers(spec).items():
        choose_layer(registry, f"controllers.{spec.name}.{layer}", name, options)
        defaults = {field.name: field.default for field in fields(registry[name].options)}
        found |= {(layer, key): it for key, it in options.items() if it != defaults[key]}
    keys = [key for _, key in found]
    return {
        key if keys.count(key) == 1 else f"{layer}.{key}": it for (layer, key), it in found.items()
    }
