"""A package of somebody's own with one operation: its files, made from a name."""

import keyword
from importlib.util import find_spec
from string import Template

from kankaku.controllers import registry
from kankaku.railway.errors import KankakuError

LONGEST = 40
"""Characters of a name. [-]"""
IMPORTED = ("Advice", "Authority", "Foresight", "Layer", "LineState", "World")
"""Classes that the module of an operation uses; its own is called otherwise."""
PROJECT_FILE, READ_FILE = "pyproject.toml", "README.md"

_PROJECT = Template("""\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "$package"
version = "0.1"
description = "An operation of one's own for Kankaku."
dependencies = ["kankaku"]

[project.entry-points."kankaku.operations"]
$name = "$module:LAYER"

[tool.setuptools]
py-modules = ["$module"]
""")
_OPERATION = Template('''\
"""An operation of one's own: whoever comes near another train keeps to a steady speed."""

from dataclasses import dataclass

import numpy as np

from kankaku import Layer
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState

NO_CEILING_MPS = 1e3


@dataclass(frozen=True)
class ${kind}Options:
    """What a scenario may set; the unit is in the name."""

    steady_kmh: float = 60.0
    near_m: float = 800.0


class $kind:
    """Keeps trains that come near the end of their authority to one speed."""

    reasons = ("$name",)

    def __init__(self, world: World, options: ${kind}Options, foresight: Foresight) -> None:
        self._steady_mps = options.steady_kmh / 3.6
        self._near_m = options.near_m

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        """Return a lower ceiling for whoever is near; what the way ends at is the cause."""
        near = state.running & (authority.eoa_m - state.front_m < self._near_m)
        ceiling_mps = np.where(near, self._steady_mps, NO_CEILING_MPS)
        return Advice(ceiling_mps, np.where(near, 0, NO_REASON), authority.eoa_by), None


LAYER = Layer($kind, ${kind}Options, "trains that come near another one keep to a steady speed")
''')
_TEST = Template('''\
"""The operation keeps the contract of Kankaku, and does something."""

import kankaku
from kankaku.testing import check_controller, failures


def test_it_keeps_the_contract() -> None:
    """Run what ``kankaku check-controller $name`` runs."""
    assert not failures(check_controller("$name"))


def test_it_changes_how_trains_run() -> None:
    """Compare a morning with the same one under close-up running."""
    usual, own = (
        kankaku.run_once("yizhuang", f"moving_block+{name}", step_s=0.5)
        for name in ("close_up", "$name")
    )
    assert own.violations.empty
    assert own.trajectory["speed_mps"].sum() != usual.trajectory["speed_mps"].sum()
''')
_README = Template("""\
# $package

An operation for Kankaku, the simulator of metropolitan railway lines: how trains use what their
protection permits. It is `$kind` in `$module.py`, and Kankaku calls it `$name`.

```sh
pip install --editable .              # once; then every command knows it
kankaku check-controller $name        # does it keep the contract?
kankaku run rush_hour --controller close_up --controller moving_block+$name
kankaku benchmark $name               # its score beside that of close-up running
python -m pytest                      # test_$name.py
```

- **What it may do**: lower the speed of a train, with a reason that stands in `reasons`. It can
  make no run unsafe.
- **What it knows**: `world` (the line, the trains, what is booked) beforehand; `state` and
  `authority` of this moment. Never the future: dwell delays are not known to it.
- **What it remembers**: what `advise` returns as its second value comes back as `memory`. Keep
  nothing else.
- **What can be set**: the fields of `${kind}Options`, for example
  `--set moving_block+$name.near_m=500`.
""")


class PackageError(KankakuError):
    """A name that no package can have."""

    verdict = "cannot be made"

    def __init__(self, mistakes: list[str]) -> None:
        super().__init__("; ".join(mistakes))
        self._mistakes = tuple(mistakes)

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return self._mistakes


def package_files(name: str) -> dict[str, str]:
    """
    Return the files of a package with one operation.

    Parameters
    ----------
    name
        Of the operation, as in ``moving_block+name``.

    Returns
    -------
    dict[str, str]
        Text by name of the file.

    Raises
    ------
    PackageError
        If nothing can have that name, or something has it already.
    """
    mistakes = _mistakes(name)
    if mistakes:
        raise PackageError(mistakes)
    kind = "".join(part.capitalize() for part in name.split("_"))
    values = {
        "name": name,
        "kind": f"Own{kind}" if kind in IMPORTED else kind,
        "module": module_of(name),
        "package": module_of(name).replace("_", "-"),
    }
    parts = {
        PROJECT_FILE: _PROJECT,
        f"{values['module']}.py": _OPERATION,
        f"test_{name}.py": _TEST,
        READ_FILE: _README,
    }
    return {file: template.substitute(values) for file, template in parts.items()}


def module_of(name: str) -> str:
    """Return the module that holds an operation of somebody's own."""
    return f"kankaku_{name}"


def _mistakes(name: str) -> list[str]:
    form = f"small letters, digits and single _ between them, at most {LONGEST}, a letter first"
    shown = name[:LONGEST]
    parts = name.split("_")
    plain = name.isascii() and name == name.lower() and name.isidentifier()
    if not plain or not all(parts) or len(name) > LONGEST:
        return [f"--name: {shown!r} is no name of an operation; allowed: {form}"]
    mistakes = []
    if keyword.iskeyword(name):
        mistakes.append(f"--name: {name!r} is a word of Python; allowed: another name")
    known = (registry.PROTECTIONS, registry.OPERATIONS, registry.SUPERVISIONS)
    for layers in known:
        if name in layers:
            of = layers.package_of(name) or "Kankaku"
            problem = f"{of} has the {layers.kind} {name!r} already"
            mistakes.append(f"--name: {problem}; allowed: another name")
    if find_spec(module_of(name)) is not None and not mistakes:
        problem = f"there is a module {module_of(name)} already"
        mistakes.append(f"--name: {problem}; allowed: another name")
    return mistakes
