"""A layer by its name with its options, checked: what is wrong and what is allowed."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from kankaku.controllers.layers import ControllerError, Layer, Registry, option_kinds
from kankaku.controllers.options import OptionError
from kankaku.railway.errors import suggesting
from kankaku.railway.plan.scenario import Option

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def choose_layer(
    registry: Registry, where: str, name: str, options: Mapping[str, Option]
) -> tuple[Layer, "DataclassInstance"]:
    """
    Return a layer and its options.

    Parameters
    ----------
    registry
        Of protections, of operations or of supervisions.
    where
        Which key names the layer, for complaints.
    name
        The layer.
    options
        Its options, as in the file.

    Returns
    -------
    tuple[Layer, DataclassInstance]
        How to build it, and an object with all its options.

    Raises
    ------
    ControllerError
        If the layer or an option is unknown, or an option's value is not allowed.
    PluginError
        If it is another package's, and cannot be used.
    """
    if name not in registry:
        raise ControllerError(where, f"{name!r} is not known", likely(name, registry))
    layer = registry[name]
    known = option_kinds(layer.options)
    for key, value in options.items():
        place = f"{where}_options.{key}"
        if key not in known:
            problem = f"option {key!r} is not known to {name}"
            raise ControllerError(place, problem, likely(key, known) or "none")
        if type(value) is not known[key].kind:
            raise ControllerError(where=place, problem=f"{value!r}", allowed=known[key].allowed)
    try:
        chosen = layer.options(**options)
    except OptionError as error:
        raise ControllerError(
            where=f"{where}_options", problem=error.problem, allowed=error.allowed
        ) from error
    return layer, chosen


def likely(name: str, known: Iterable[str]) -> str:
    """
    Return what is allowed instead of an unknown name, the likeliest one first.

    Parameters
    ----------
    name
        What was said.
    known
        What may be said.

    Returns
    -------
    str
        All names.
    """
    names = list(known)
    return suggesting(name, names, ", ".join(names))
