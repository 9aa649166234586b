"""Takes the steps between events in one go, where engine and layers offer it."""

from typing import Any, TypeAlias

import numpy as np

from kankaku.railway.compiled import Plain, plain
from kankaku.railway.loop.compiled_loop import steps_of
from kankaku.railway.loop.radio_loop import steps_by_radio
from kankaku.railway.loop.recorder import Recorder
from kankaku.railway.loop.supervising import Supervising
from kankaku.railway.loop.tracker import Tracker
from kankaku.railway.step.bundles import LayerSteps, offered
from kankaku.railway.step.control import Controller
from kankaku.railway.step.engine_contract import Observation
from kankaku.railway.step.state import LineState

_Remembering: TypeAlias = tuple[LayerSteps, tuple[Plain, Plain]]
"""A layer's steps, and arrays for its memory before and after a step, which take turns."""
_Prepared: TypeAlias = tuple[_Remembering, _Remembering, LayerSteps]


class Bundling:
    """
    Runs bundles of steps.

    Parameters
    ----------
    engine
        What moves the trains.
    controller
        The layers.
    tracker, recorder
        Who is told of steps.
    until_s
        The run is over then, or pauses. [s]
    """

    def __init__(
        self,
        engine: Any,  # noqa: ANN401 - one that offers spans has more than the contract
        controller: Controller,
        tracker: Tracker,
        recorder: Recorder,
        until_s: float,
    ) -> None:
        self._engine = engine
        # Layers that offer steps have more than their contracts say.
        self._layers: tuple[Any, Any, Any] = (
            controller.protection,
            controller.operation,
            controller.drive,
        )
        self._tracker, self._recorder = tracker, recorder
        self.until_s = until_s
        """No step that begins then or later is taken. [s]"""
        self.possible = offered(engine, "span", "observe", "apply", "advance", "hold") and all(
            offered(layer, "steps", method)
            for layer, method in zip(self._layers, ("authorise", "advise", "command"), strict=True)
        )
        """Whether all of them offer compiled steps."""
        self._prepared: _Prepared | None = None

    def asked_in_python(self) -> None:
        """Take note that the layers have made a step of their own."""
        self._prepared = None

    def take(
        self,
        seen: Observation,
        state: LineState,
        memories: tuple[Any, Any],
        supervising: Supervising | None,
    ) -> tuple[int, tuple[Any, Any]]:
        """
        Take as many steps as can be taken without an event.

        Parameters
        ----------
        seen
            What the engine observes, without an event.
        state
            The state of the last step that was made in Python.
        memories
            What protection and operation remember.
        supervising
            Who decides at platforms.

        Returns
        -------
        tuple[int, tuple[Any, Any]]
            How many steps were taken, perhaps none, and what the layers remember then.
        """
        quiet_s = self.until_s if supervising is None else supervising.quiet_until_s
        if seen.time_s >= quiet_s:
            return 0, memories
        span = self._engine.span()
        if span is None or seen.time_s >= span.until_s:
            return 0, memories
        if self._prepared is None:
            self._prepared = self._prepare(state, memories)
        (guarding, _), (operating, _), _ = self._prepared
        until_s = min(self.until_s, quiet_s, guarding.until_s, operating.until_s)
        radio = self._tracker.radio
        if guarding.by_radio != (radio is not None):
            return 0, memories
        if radio is not None:
            until_s = min(until_s, radio.until_s)
        watched = self._tracker.watched(until_s)
        if seen.time_s >= watched.until_s:
            return 0, memories
        most, kept, sampling = self._recorder.space(span.time_s.size)
        front_m, speed_mps = seen.front_m.copy(), seen.speed_mps.copy()
        trains = front_m, front_m - watched.length_m, speed_mps, state.clear_to_m.copy()
        commanded_mps = np.empty((most, span.rows.size))
        given = trains, (plain(span), tuple(watched), state.lasting)
        written = commanded_mps, tuple(kept), tuple(sampling)
        taken, samples, until_sample = self._run(self._prepared, given, written)
        if not taken:
            return 0, memories
        if radio is not None:
            self._recorder.heard(taken)
        self._recorder.wrote(taken, samples, until_sample)
        self._engine.moved(commanded_mps[:taken], front_m, speed_mps)
        (_, permitted), (_, planned), _ = self._prepared
        protection, operation = self._layers[:2]
        return taken, (
            protection.resumed(memories[0], permitted[0]),
            operation.resumed(memories[1], planned[0]),
        )

    def _run(self, prepared: _Prepared, given: Plain, written: Plain) -> tuple[int, int, int]:
        """Return how many steps were taken, and samples; remember what the layers do then."""
        (guarding, permitted), (operating, planned), driving = prepared
        above = (operating.fields, *planned, operating.told), (driving.fields, driving.told)
        functions = guarding.function, operating.function, driving.function
        radio = self._tracker.radio
        if radio is None:
            layers = ((guarding.fields, *permitted, guarding.told), *above)
            counts = steps_of(*functions)(*given, layers, *written)
            permitted = permitted[::-1] if counts[0] % 2 else permitted
        else:
            on_air, own = (radio.air, self._recorder.heard_rows()), (guarding.fields, permitted[0])
            *counts, after = steps_by_radio(*functions)(*given, above, *written, on_air, *own)
            permitted = after, after
        taken, samples, until_sample = counts
        if taken:
            planned = planned[::-1] if taken % 2 else planned
            self._prepared = (guarding, permitted), (operating, planned), driving
        return taken, samples, until_sample

    def _prepare(self, state: LineState, memories: tuple[Any, Any]) -> _Prepared:
        protection, operation, drive = self._layers
        guarding = protection.steps(state, memories[0])
        operating = operation.steps(state, memories[1])
        return _remembering(guarding), _remembering(operating), drive.steps(state)


def _remembering(steps: LayerSteps) -> _Remembering:
    if steps.by_radio:
        # Its memory is made anew in every step, and never written to.
        return steps, (steps.memory, steps.memory)
    return steps, (_copied(steps.memory), _copied(steps.memory))


def _copied(memory: Plain) -> Plain:
    return tuple(_copied(part) if isinstance(part, tuple) else part.copy() for part in memory)


def nothing_happened(seen: Observation) -> bool:
    """
    Return whether an observation tells of no event.

    Parameters
    ----------
    seen
        The observation.

    Returns
    -------
    bool
        Collisions are no event: trains run on.
    """
    return not (seen.entered or seen.stopped or seen.released or seen.left)
