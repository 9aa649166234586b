"""The only door to a running SUMO: how it is started, disarmed and ended."""

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any

from kankaku.sumo_net.build import SumoFiles, sumo_binary

UNLIMITED_MPS2 = 1000.0
"""More than any brake rate that a command can ask for. [m/s2]"""
VIEW = """<viewsettings>
  <scheme name="kankaku">
    <edges widthExaggeration="12"/>
    <vehicles vehicle_minSize="1" vehicle_exaggeration="12"/>
  </scheme>
  <delay value="20"/>
</viewsettings>
"""
"""Tracks and trains wide enough to be seen on a whole line; 20 ms of wall time a step."""
GUI_TRIES = 10
"""How often to look for the window of sumo-gui, a second apart."""


def disarm(sumo: Any, train_type: str) -> None:  # noqa: ANN401
    """
    Take from SUMO's own model what it would do to a train beside our commands.

    A train that cannot accelerate stands still where no command reaches it: when it enters
    and when its stop ends. A train that can brake at any rate comes to its stand in the
    step commanded, although SUMO takes over in the step in which the stop begins.

    Parameters
    ----------
    sumo
        The running simulation.
    train_type
        Identifier of the vehicle type.
    """
    sumo.vehicletype.setAccel(train_type, 0.0)
    sumo.vehicletype.setEmergencyDecel(train_type, UNLIMITED_MPS2)
    sumo.vehicletype.setDecel(train_type, UNLIMITED_MPS2)


def start(files: SumoFiles, options: Mapping[str, str], *, gui: bool) -> Any:  # noqa: ANN401
    """
    Start SUMO.

    Parameters
    ----------
    files
        What it runs.
    options
        Options beside those of the files.
    gui
        Run in sumo-gui instead of inside this process.

    Returns
    -------
    Any
        The library through which it is spoken to.

    Raises
    ------
    OSError
        If there is no window.
    """
    # The package that ships the programs tells SUMO where its data is.
    importlib.import_module("sumo")
    sumo = importlib.import_module("traci" if gui else "libsumo")
    command = [str(sumo_binary("sumo-gui")) if gui else "sumo", "-c", str(files.config)]
    command += ["--no-warnings", *(f"--{option}={value}" for option, value in options.items())]
    if gui:
        view = files.config.with_name("view.xml")
        view.write_text(VIEW, encoding="utf-8")
        command += ["--start", "--quit-on-end", "--window-size=1280,800"]
        command.append(f"--gui-settings-file={view}")
    try:
        sumo.start(command, **({"numRetries": GUI_TRIES} if gui else {}))
    except sumo.FatalTraCIError as error:
        msg = "sumo-gui does not answer; is there a display?"
        raise OSError(msg) from error
    return sumo


def bare(domain: Any, method: str) -> Callable[..., Any]:  # noqa: ANN401
    """
    Return a method of SUMO without what Python lays around it.

    Called for every train in every step, the wrapper costs half of what it wraps.

    Parameters
    ----------
    domain
        A domain of the library through which SUMO is spoken to, such as ``vehicle``.
    method
        Name of the method.

    Returns
    -------
    Callable[..., Any]
        The function below it where SUMO runs inside this process; else the method itself.
    """
    found: Callable[..., Any] = getattr(domain, method)
    inside = sys.modules.get("libsumo._libsumo")
    name = f"{getattr(domain, '__name__', '')}_{method}"
    if inside is not None and str(getattr(domain, "__module__", "")).startswith("libsumo"):
        found = getattr(inside, name, found)
    return found


def close(sumo: Any, error: BaseException | None) -> None:  # noqa: ANN401
    """
    End SUMO; a window that the user closed interrupts the run like Ctrl-C.

    Parameters
    ----------
    sumo
        The running simulation.
    error
        What ended the run, if not its end.

    Raises
    ------
    KeyboardInterrupt
        If the window is closed.
    """
    # Only a window can be closed; inside this process it is an error as any other.
    if isinstance(error, sumo.FatalTraCIError) and sumo.__name__ == "traci":
        raise KeyboardInterrupt from error
    sumo.close()
