"""What a layer is registered as, and where those of others come from."""

from collections import UserDict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import Enum
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias, get_type_hints

from kankaku.railway.errors import KankakuError, sentence_of
from kankaku.railway.plan.radio_spec import RadioSpec
from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import (
    Foresight,
    Operation,
    Protection,
    Separation,
    Supervision,
)
from kankaku.railway.step.promises import Promises

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


class Medium(Enum):
    """How the permissions of a protection reach the trains."""

    TRACK = "through the track: ``radio = true`` is refused"
    EITHER = "at once, or with ``radio = true`` by radio from a centre that has reports only"
    RADIO = "always by radio: the protection is built from the radio, too"


class Guarding(Protection[Any], Foresight, Protocol):
    """A protection as controllers need it: it also says what it will permit, and promises."""

    @property
    def separation(self) -> Separation:
        """What keeps its trains apart."""
        ...

    @property
    def promises(self) -> Promises | None:
        """What it promises beyond bare safety."""
        ...


class ProtectionFactory(Protocol):
    """Builds a protection from the world and its options."""

    def __call__(self, world: World, options: Any, /) -> Guarding:  # noqa: ANN401 - its own class
        """Return the protection."""
        ...


class RadioFactory(Protocol):
    """Builds a protection that always goes by radio."""

    def __call__(self, world: World, options: Any, radio: RadioSpec, /) -> Guarding:  # noqa: ANN401
        """Return the protection."""
        ...


class OperationFactory(Protocol):
    """Builds an operation from the world, its options, and what its protection will permit."""

    def __call__(
        self,
        world: World,
        options: Any,  # noqa: ANN401 - its own class
        foresight: Foresight,
        /,
    ) -> Operation[Any]:
        """Return the operation."""
        ...


class SupervisionFactory(Protocol):
    """Builds a supervision from the world and its options; None where nobody decides."""

    def __call__(self, world: World, options: Any, /) -> Supervision[Any] | None:  # noqa: ANN401
        """Return the supervision."""
        ...


Factory: TypeAlias = ProtectionFactory | RadioFactory | OperationFactory | SupervisionFactory


@dataclass(frozen=True, slots=True)
class Layer:
    """
    How to build a protection, an operation or a supervision; what an entry point stands for.

    A protection or supervision is built from the world and its options (a protection that always
    goes by radio from the radio, too), an operation also from what its protection will permit.
    """

    build: Factory
    options: "type[DataclassInstance]"
    """A frozen dataclass; its fields are the keys that a scenario may set."""
    summary: str
    medium: Medium = Medium.TRACK
    """Of a protection."""
    knows_future: bool = False
    """Of an operation that is told the drawn dwell delays: it is there for comparison only."""


class ControllerError(KankakuError):
    """A controller that cannot be built: which key, what is wrong, what is allowed."""

    @property
    def sentences(self) -> tuple[str, ...]:
        """The file is named, too, where the key stands in one."""
        return (f"{MAIN_FILE}: {self}" if self.where.startswith("controllers.") else str(self),)


class PluginError(KankakuError):
    """A layer of another package that cannot be used."""


class OptionKind(NamedTuple):
    """What values an option takes."""

    kind: type
    """Of its values, as a file gives them."""
    allowed: str


OPTION_KINDS: Mapping[object, OptionKind] = {
    bool: OptionKind(bool, "true or false"),
    float: OptionKind(float, "a number"),
    tuple[float, ...]: OptionKind(tuple, "a list of numbers"),
}
"""By the type that a field of an options class is declared with."""
_TYPES = "float, bool or tuple[float, ...]"


def option_kinds(options: "type[DataclassInstance]") -> dict[str, OptionKind]:
    """
    Return what the options of a layer take.

    Parameters
    ----------
    options
        The class of its options; annotations may be texts.

    Returns
    -------
    dict[str, OptionKind]
        By option.

    Raises
    ------
    PluginError
        If an option has another type than files can hold, or no default.
    """
    hints = get_type_hints(options)
    found: dict[str, OptionKind] = {}
    for field in fields(options):
        kind = OPTION_KINDS.get(hints[field.name])
        where = f"{options.__qualname__}.{field.name}"
        if kind is None:
            raise PluginError(where, f"is of type {_told(hints[field.name])}", _TYPES)
        if field.default is MISSING:
            raise PluginError(where, "has no default", "a value that makes sense on any line")
        found[field.name] = kind
    return found


def _told(hint: object) -> str:
    return hint.__name__ if isinstance(hint, type) else str(hint)


def checked(layer: object, where: str) -> Layer:
    """
    Return what others offer as a layer, if it is one that can be used.

    Parameters
    ----------
    layer
        Anything.
    where
        Whose it is, for complaints.

    Returns
    -------
    Layer
        The same.

    Raises
    ------
    PluginError
        If it is no layer, or one of its parts is not what it has to be.
    """
    if not isinstance(layer, Layer):
        raise PluginError(where, f"is a {type(layer).__name__}", "a kankaku.Layer")
    if not callable(layer.build):
        raise PluginError(where, f"is built by {layer.build!r}", "a class or a function")
    if not isinstance(layer.summary, str) or not isinstance(layer.medium, Medium):
        raise PluginError(where, "tells of itself otherwise", "a text, and a kankaku.Medium")
    if not isinstance(layer.options, type) or not is_dataclass(layer.options):
        raise PluginError(where, f"has {layer.options!r} for options", "a frozen dataclass")
    try:
        option_kinds(layer.options)
    except PluginError as error:
        raise PluginError(where, f"{error.where} {error.problem}", error.allowed) from error
    except (NameError, TypeError) as error:
        raise PluginError(where, sentence_of(error), f"options of {_TYPES}") from error
    return layer


class Registry(UserDict[str, Layer]):
    """
    Layers by name: our own, those registered while the program runs, and those of packages.

    A package offers a layer by an entry point; it is not imported before it is asked for. Our
    own names come first.
    """

    def __init__(self, kind: str, group: str, own: Mapping[str, Layer]) -> None:
        super().__init__(own)
        self.kind = kind
        self.group = group
        self._own = frozenset(own)

    @cached_property
    def offered(self) -> Mapping[str, tuple[EntryPoint, ...]]:
        """Entry points by name; more than one where packages disagree."""
        found: dict[str, tuple[EntryPoint, ...]] = {}
        for point in entry_points(group=self.group):
            found[point.name] = (*found.get(point.name, ()), point)
        return found

    def register(self, name: str, layer: Layer) -> None:
        """
        Add a layer for as long as the program runs.

        Parameters
        ----------
        name
            As scenarios and the command line are to name it.
        layer
            How to build it.

        Raises
        ------
        PluginError
            If the name is one of ours or of a package, or no name; or if the layer is not made
            as layers have to be.
        """
        where = f"{self.kind} {name!r}"
        if name in self._own or name in self.offered:
            raise PluginError(where, "is there already", "another name")
        if not name.isidentifier():
            raise PluginError(where, "is no name", "letters, digits and _")
        self.data[name] = checked(layer, where)

    def added(self, names: Collection[str] | None = None) -> Mapping[str, Layer]:
        """Return the layers, or those of some names, that were registered while it runs."""
        return {
            name: layer
            for name, layer in self.data.items()
            if name not in self._own and (names is None or name in names)
        }

    def restore(self, layers: Mapping[str, Layer]) -> None:
        """
        Add in a worker process what was registered in the one that began it.

        Parameters
        ----------
        layers
            What :meth:`added` returned there.
        """
        self.data.update(layers)

    def package_of(self, name: str) -> str:
        """Return the package that a layer comes from; empty for our own."""
        if name in self.data:
            return "" if name in self._own else "registered"
        return ", ".join(package_named(point) for point in self.offered.get(name, ()))

    def __missing__(self, name: str) -> Layer:
        """Import a layer of a package."""
        if name not in self.offered:
            raise KeyError(name)
        points = self.offered[name]
        where = f"{self.kind} {name!r} of {' and '.join(map(package_named, points))}"
        if len(points) > 1:
            raise PluginError(where, "two packages have that name", "one of them")
        try:
            layer = points[0].load()
        except Exception as error:
            raise PluginError(
                where, sentence_of(error), "a package that can be imported"
            ) from error
        return checked(layer, where)

    def overruled(self, name: str) -> str:
        """
        Return whether a package offers a layer of a name that is not its own to give.

        Parameters
        ----------
        name
            Of a layer of ours.

        Returns
        -------
        str
            A sentence; empty if there is no such package.
        """
        packages = " and ".join(map(package_named, self.offered.get(name, ())))
        if name not in self.data or not packages:
            return ""
        return f"{self.kind} {name!r} of {packages} is left out: Kankaku has one of that name"

    def __contains__(self, name: object) -> bool:
        """Return whether there is such a layer, imported or not."""
        return name in self.data or name in self.offered

    def __iter__(self) -> Iterator[str]:
        """Name the layers, our own first."""
        yield from self.data
        yield from (name for name in self.offered if name not in self.data)

    def __len__(self) -> int:
        """Count the layers."""
        return sum(1 for _ in self)


def package_named(point: EntryPoint) -> str:
    """Return the package of an entry point."""
    return point.dist.name if point.dist else point.value
