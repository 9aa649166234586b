"""Layers that were registered while the program runs: worker processes have to be told of them."""

import pickle
import sys
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from kankaku.controllers import registry
from kankaku.controllers.layers import Layer
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.studies.outcomes import StudyError


class Registered(NamedTuple):
    """Layers that were registered while the program runs; workers have to be told of them."""

    protections: Mapping[str, Layer]
    operations: Mapping[str, Layer]
    supervisions: Mapping[str, Layer]

    def restore(self) -> None:
        """Register them here, too."""
        registry.PROTECTIONS.restore(self.protections)
        registry.OPERATIONS.restore(self.operations)
        registry.SUPERVISIONS.restore(self.supervisions)


def registered(specs: Sequence[ControllerSpec]) -> Registered:
    """
    Return the layers of some controllers that were registered while the program runs.

    Parameters
    ----------
    specs
        The controllers that are run.

    Returns
    -------
    Registered
        What a worker process registers first.

    Raises
    ------
    StudyError
        If one of them stands in no file that a worker could import.
    """
    used = {name for spec in specs for name in (spec.protection, spec.operation, spec.supervision)}
    found = Registered(
        registry.PROTECTIONS.added(used),
        registry.OPERATIONS.added(used),
        registry.SUPERVISIONS.added(used),
    )
    for name, layer in (item for layers in found for item in layers.items()):
        try:
            pickle.dumps(layer)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            allowed = "a class at the top of a module, or run_once"
            raise StudyError(name, "worker processes cannot import it", allowed) from error
        if layer.build.__module__ == "__main__" and not hasattr(
            sys.modules["__main__"], "__file__"
        ):
            allowed = "a module of its own, an entry point, or run_once"
            raise StudyError(name, "is defined in a notebook, which workers cannot read", allowed)
    return found
