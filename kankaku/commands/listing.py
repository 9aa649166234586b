"""What controllers there are: those that can be built, those of a scenario, and the versions."""

from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import NamedTuple

from kankaku.controllers import registry
from kankaku.controllers.choosing import changed_options
from kankaku.controllers.eco_layer.eco_margin import SUMMARY, WORD
from kankaku.controllers.layers import PluginError, Registry
from kankaku.railway.plan.scenario import UNSUPERVISED, ControllerSpec


class Listing(NamedTuple):
    """A table of texts."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def known_controllers() -> tuple[Listing, ...]:
    """
    Return protections, operations, supervisions, other layers and peers that one can name.

    Returns
    -------
    tuple[Listing, ...]
        A table each.
    """
    layers = (
        _listing("Protection (how far and how fast a train may go)", registry.PROTECTIONS),
        _listing("Operation (how it uses that permission)", registry.OPERATIONS),
        _listing("Supervision (what it decides at platforms)", registry.SUPERVISIONS),
    )
    peers = tuple((name, peer.summary) for name, peer in registry.PEERS.items())
    energy = Listing(
        "Energy layer (around any operation, by keys of the controller)",
        ("name", "what it does", "keys"),
        ((WORD, SUMMARY, "eco_margin_s = a number\neco_reserve = false"),),
    )
    return (
        *layers,
        energy,
        Listing("Peer (drives the trains itself)", ("name", "what it does"), peers),
    )


def _listing(title: str, layers: Registry) -> Listing:
    left_out = tuple((name, layers.overruled(name), "") for name in layers)
    return Listing(
        title,
        ("name", "what it does", "options"),
        (*(_layer_row(layers, name) for name in layers), *(row for row in left_out if row[1])),
    )


def _layer_row(layers: Registry, name: str) -> tuple[str, str, str]:
    package = layers.package_of(name)
    try:
        layer = layers[name]
    except PluginError as error:
        return name, str(error), ""
    told = f"{layer.summary} (package {package})" if package else layer.summary
    return name, told, _lines((it.name, it.default) for it in fields(layer.options))


def controllers_of(title: str, specs: Sequence[ControllerSpec]) -> Listing:
    """
    Return the controllers of a scenario.

    Parameters
    ----------
    title
        Of the scenario.
    specs
        Its controllers.

    Returns
    -------
    Listing
        Layers, what is not the default, and whether they run where none are named.

    Raises
    ------
    ControllerError
        If a layer or an option is not allowed.
    """
    return Listing(
        title,
        ("name", "protection", "operation", "options that differ", "runs by default"),
        tuple(_row(spec) for spec in specs),
    )


def _row(spec: ControllerSpec) -> tuple[str, ...]:
    layers = (f"peer {spec.peer}", "-") if spec.peer else (spec.protection, spec.operation)
    supervision = "" if spec.supervision == UNSUPERVISED else spec.supervision
    beside: dict[str, object] = {
        "supervision": supervision,
        "radio": spec.radio,
        "eco_margin_s": spec.eco_margin_s,
        "eco_reserve": spec.eco_reserve,
    }
    options = {**changed_options(spec), **{key: it for key, it in beside.items() if it}}
    return spec.name, *layers, _lines(options.items()), "yes" if spec.by_default else "no"


def _lines(options: Iterable[tuple[str, object]]) -> str:
    return "\n".join(f"{name} = {_toml(value)}" for name, value in options)


def _toml(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)
