"""Write what SUMO reads; the network is built once per content and kept in a cache."""

import hashlib
import math
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree as ET

from kankaku.railway.arrays import FloatArray
from kankaku.railway.places import CACHE, cache_folder, chosen_cache
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.sumo_net import native_xml, network_xml, plain_xml, routes_xml, witness_xml

NETCONVERT_OPTIONS = (
    "--no-internal-links",
    "--no-turnarounds",
    "--offset.disable-normalization",
    "--precision=3",
    "--no-warnings",
)

IGNORE_SIGNALS = {"railsignal.default-classes": "ship"}
"""
Option that leaves signals to a class that never runs.

Else a train enters only when the stretch to the next signal is free, which without signals
is the whole line. The option holds for signals in the network, too: they stay green. An
empty value would say it better, but SUMO does not read one from a file.
"""

_PROCESSING = {"time-to-teleport": "-1", "collision.action": "warn"}
COMMANDED_OPTIONS = {"step-method.ballistic": "true", **_PROCESSING}
NATIVE_OPTIONS = {**_PROCESSING, "collision.mingap-factor": "0"}
"""SUMO's rail model knows no ballistic steps; trains collide when they touch, not before."""
WITNESS_OPTIONS = {**COMMANDED_OPTIONS, **IGNORE_SIGNALS, "insertion-checks": "none"}
"""Else a train that stands on a two-way track would keep others out of all of it."""
WITNESS_S = 1.0
"""How often SUMO looks that is only a witness. [s]"""


@dataclass(frozen=True, slots=True, eq=False)
class SumoFiles:
    """What a run of SUMO needs; all files lie in one folder and name each other relatively."""

    config: Path
    network: Path
    begin_s: float
    """Time of the first step. [s]"""
    dwell_s: FloatArray
    """How long each stop holds its train at least. [s], shape (n_trains, n_calls_max)"""


class NetworkError(RuntimeError):
    """SUMO's netconvert refused the network."""


def sumo_binary(name: str) -> Path:
    """
    Return the path of a program of the eclipse-sumo package.

    Parameters
    ----------
    name
        ``sumo``, ``sumo-gui`` or ``netconvert``.

    Returns
    -------
    Path
        The program.

    Raises
    ------
    FileNotFoundError
        If the package or the program is missing.
    """
    package = find_spec("sumo")
    if package is None or package.origin is None:
        msg = "the Python package eclipse-sumo is not installed"
        raise FileNotFoundError(msg)
    folder = Path(package.origin).parent / "bin"
    found = shutil.which(name, path=str(folder))
    if found is None:
        msg = f"{name} is missing in {folder}"
        raise FileNotFoundError(msg)
    return Path(found)


def network(line: Line) -> Path:
    """
    Return the SUMO network of a line, built if the cache does not hold it unharmed.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Path
        The network file in the cache.

    Raises
    ------
    NetworkError
        If netconvert refuses the network.
    OSError
        If there is no cache that can be written.
    """
    name, content = _network(line)
    cache = cache_folder()
    if cache is None:
        msg = f"no folder for networks can be written; {CACHE} can name one"
        raise FileNotFoundError(msg)
    if _kept(cache / name) != content:
        _keep(content, cache / name)
    return cache / name


def _network(line: Line) -> tuple[str, bytes]:
    """Return the name in the cache and the network; a cache that nobody chose may be missing."""
    if line.network:
        plain = network_xml.plain_network(line)
    else:
        plain = {
            "node": plain_xml.nodes_xml(line),
            "edge": plain_xml.edges_xml(line),
            "connection": plain_xml.connections_xml(line),
        }
    content = "\0".join([version("eclipse-sumo"), *NETCONVERT_OPTIONS, *plain.values()])
    cache = cache_folder()
    name = f"{hashlib.sha256(content.encode()).hexdigest()}.net.xml"
    found = _kept(cache / name) if cache else None
    if found is None:
        with tempfile.TemporaryDirectory(prefix="kankaku-") as work:
            found = _netconvert(plain, Path(work)).read_bytes()
        if cache:
            _keep(found, cache / name)
    return name, found


def _kept(file: Path) -> bytes | None:
    """Return a network of the cache; nothing if it is not there, or not what was written."""
    try:
        content, digest = file.read_bytes(), _beside(file).read_text("ascii").strip()
    except (OSError, ValueError):
        return None
    return content if hashlib.sha256(content).hexdigest() == digest else None


def _keep(content: bytes, file: Path) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        # Whoever is ended between the two leaves a network that counts as damaged.
        _write_whole(file, content)
        _write_whole(_beside(file), hashlib.sha256(content).hexdigest().encode())
    except OSError as error:
        if chosen_cache():
            place = f"{file.parent} ({CACHE})"
            raise OSError(error.errno, error.strerror or str(error), place) from error


def _beside(file: Path) -> Path:
    return file.with_suffix(".sha256")


def _write_whole(file: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile(dir=file.parent, prefix=".", delete=False) as partial:
        try:
            partial.write(content)
            partial.close()
            # Renaming is atomic: a parallel run sees the whole file or none.
            Path(partial.name).replace(file)
        except BaseException:
            Path(partial.name).unlink(missing_ok=True)
            raise


def _netconvert(plain: Mapping[str, str], work: Path) -> Path:
    inputs = []
    for kind, text in plain.items():
        (work / f"{kind}.xml").write_text(text, encoding="utf-8")
        inputs.append(f"--{kind}-files={kind}.xml")
    command = [
        str(sumo_binary("netconvert")),
        *inputs,
        *NETCONVERT_OPTIONS,
        "--output-file=net.xml",
    ]
    done = subprocess.run(command, cwd=work, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        msg = f"netconvert failed: {done.stderr.strip()}"
        raise NetworkError(msg)
    return work / "net.xml"


def build(
    scenario: Scenario,
    world: World,
    dwell_delay_s: FloatArray,
    folder: Path,
    *,
    signals: bool = True,
) -> SumoFiles:
    """
    Write everything that a run of SUMO needs.

    Parameters
    ----------
    scenario
        Line, fleet and timetable.
    world
        Whose step is used.
    dwell_delay_s
        Dwell delay of every call. [s], shape (n_trains, n_calls_max)
    folder
        Where to write; made if missing.
    signals
        Draw the line's signals, which SUMO's own control of the trains obeys. Controllers
        do not need them, and without them SUMO has fewer edges to look after: the shortest
        computing time of a run.

    Returns
    -------
    SumoFiles
        Configuration that ``sumo -c`` runs as it is: SUMO then drives the trains itself,
        until the last one has left the line. That of a network has no trains, and neither
        signals: the engine adds trains while it runs.

    Raises
    ------
    NetworkError
        If netconvert refuses the network.
    """
    if scenario.line.network:
        return build_witness(scenario, world, dwell_delay_s, folder)
    # Limits are the controller's, not SUMO's.
    blocks = scenario.line.blocks if signals else ()
    line = replace(scenario.line, limits=(), blocks=blocks)
    options = COMMANDED_OPTIONS | ({} if blocks else IGNORE_SIGNALS)
    routes = routes_xml.routes_xml(
        line, scenario.train_types.values(), scenario.timetable, dwell_delay_s, world.step_s
    )
    files = {"platforms.add.xml": plain_xml.platforms_xml(line), "trains.rou.xml": routes}
    return _write(folder, line, files, options, (world, world.step_s), dwell_delay_s)


def build_witness(
    scenario: Scenario, world: World, dwell_delay_s: FloatArray, folder: Path
) -> SumoFiles:
    """
    Write what SUMO needs that only looks at trains, on a chain or on a network.

    Parameters
    ----------
    scenario
        Line, fleet and timetable.
    world
        Whose step is used.
    dwell_delay_s
        Dwell delay of every call. [s], shape (n_trains, n_calls_max)
    folder
        Where to write; made if missing.

    Returns
    -------
    SumoFiles
        Without trains: the engine adds them while it runs.

    Raises
    ------
    NetworkError
        If netconvert refuses the network.
    """
    line, services = witnessed(scenario.line), scenario.timetable.services
    drawn = network_xml.network_platforms_xml if line.network else plain_xml.platforms_xml
    kinds = scenario.train_types.values()
    files = {
        "platforms.add.xml": drawn(line),
        "trains.rou.xml": witness_xml.witness_routes_xml(line, kinds, services),
    }
    period_s = world.step_s * steps_per_look(world.step_s)
    return _write(folder, line, files, WITNESS_OPTIONS, (world, period_s), dwell_delay_s)


def witnessed(line: Line) -> Line:
    """
    Return a line as SUMO is given it that only looks at trains.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Line
        A chain without limits and signals, which would only cut its tracks; a network as it is.
    """
    return line if line.network else replace(line, limits=(), blocks=())


def steps_per_look(step_s: float) -> int:
    """
    Return after how many control steps SUMO looks that is only a witness.

    Parameters
    ----------
    step_s
        Length of a control step. [s]

    Returns
    -------
    int
        As many as make a second; 1 if no whole number does. [-]
    """
    steps = round(WITNESS_S / step_s)
    return steps if abs(steps * step_s - WITNESS_S) < 1e-9 else 1


def build_native(
    scenario: Scenario,
    world: World,
    dwell_delay_s: FloatArray,
    folder: Path,
    *,
    moving_block: bool,
) -> SumoFiles:
    """
    Write what a run needs in which SUMO's own model drives the trains.

    Parameters
    ----------
    scenario
        Line, fleet and timetable.
    world
        Whose step is used.
    dwell_delay_s
        Dwell delay of every call. [s], shape (n_trains, n_calls_max)
    folder
        Where to write; made if missing.
    moving_block
        Keep trains apart by their distance, not by blocks.

    Returns
    -------
    SumoFiles
        Configuration that ``sumo -c`` runs as it is.

    Raises
    ------
    NetworkError
        If netconvert refuses the network.
    """
    line = native_xml.native_line(scenario.line, moving_block=moving_block)
    timetable = scenario.timetable
    options = NATIVE_OPTIONS | ({"railsignal-moving-block": "true"} if moving_block else {})
    kinds = scenario.train_types.values()
    files = {
        "order.add.xml": native_xml.order_xml(line, timetable),
        "platforms.add.xml": plain_xml.platforms_xml(line),
        "trains.rou.xml": routes_xml.routes_xml(
            line, kinds, timetable, dwell_delay_s, world.step_s, native_xml.NATIVE
        ),
    }
    return _write(folder, line, files, options, (world, world.step_s), dwell_delay_s)


def _write(
    folder: Path,
    line: Line,
    files: Mapping[str, str],
    options: Mapping[str, str],
    clock: tuple[World, float],
    dwell_delay_s: FloatArray,
) -> SumoFiles:
    """Write the network, the files and the configuration that names them."""
    world, period_s = clock
    begin_s = math.floor(float(world.booked_arrival_s[:, 0].min()) - world.step_s) - 1.0
    folder.mkdir(parents=True, exist_ok=True)
    net = folder / "line.net.xml"
    net.write_bytes(_network(line)[1])
    additional = ",".join(name for name in files if name.endswith(".add.xml"))
    configuration = _configuration_xml(additional, begin_s, period_s, options)
    for name, text in {**files, "line.sumocfg": configuration}.items():
        (folder / name).write_text(text, encoding="utf-8")
    dwell_s = world.minimum_dwell_s[:, :-1] + dwell_delay_s
    return SumoFiles(folder / "line.sumocfg", net, begin_s, dwell_s)


def _configuration_xml(
    additional: str, begin_s: float, step_s: float, options: Mapping[str, str]
) -> str:
    groups: dict[str, Mapping[str, str]] = {
        "input": {
            "net-file": "line.net.xml",
            "additional-files": additional,
            "route-files": "trains.rou.xml",
        },
        "time": {
            "begin": f"{begin_s:.0f}",
            "step-length": f"{step_s:.3f}",
        },
        "processing": options,
        "report": {"no-step-log": "true"},
    }
    root = ET.Element("configuration")
    for group, members in groups.items():
        element = ET.SubElement(root, group)
        for option, value in members.items():
            ET.SubElement(element, option, value=value)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
