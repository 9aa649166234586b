"""What the build of the documentation does between two tutorials."""

from kankaku.controllers.registry import OPERATIONS, PROTECTIONS


def forget_layers(*_: object) -> None:
    """Forget the protections and operations that a tutorial has registered."""
    for registry in (PROTECTIONS, OPERATIONS):
        for name in list(registry.added()):
            del registry[name]
