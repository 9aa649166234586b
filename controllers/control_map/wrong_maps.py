"""A centre whose planning channel makes wrong maps for a time; campaigns test the rest."""

import numpy as np

from kankaku.controllers.centre.reports import Reports
from kankaku.controllers.control_map.map_protection import ControlMap, ControlMapOptions
from kankaku.controllers.control_map.planned_map import MapPlan
from kankaku.railway.arrays import FloatArray
from kankaku.railway.failures.unit_failures import UnitFailure, Variant
from kankaku.railway.plan.radio_spec import RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState


class WrongMaps(ControlMap):
    """The control map with a failure of kind ``FailureMode.MAP``."""

    def __init__(
        self, world: World, options: ControlMapOptions, radio: RadioSpec, failure: UnitFailure
    ) -> None:
        super().__init__(world, options, radio)
        self._failure = failure
        self._row = world.timetable.trains.index(failure.unit)

    def plan(
        self,
        state: LineState,
        reports: Reports,
        earlier: MapPlan,
        longer_m: FloatArray | None = None,
    ) -> MapPlan:
        """
        Make a map, a wrong one while the failure lasts.

        Parameters
        ----------
        state
            The line.
        reports
            What trains have reported.
        earlier
            The map that they have gone by since.
        longer_m
            By so much bands are longer. [m], shape (n_trains,)

        Returns
        -------
        MapPlan
            Run curves and bands.
        """
        failure, chosen = self._failure, np.arange(self._world.size) == self._row
        wrong = failure.during(state.time_s)
        if wrong and failure.variant is Variant.BAND:
            reports = reports._replace(front_m=reports.front_m + failure.size * chosen)
        if wrong and failure.variant is Variant.LEFT_OUT:
            state = state._replace(
                present=state.present & ~chosen,
                front_m=np.where(chosen, self._world.far_m, state.front_m),
            )
        if wrong and failure.variant is Variant.IGNORED:
            concerns = state.wayside.concerns & ~chosen[:, np.newaxis]
            state = state._replace(
                granted_to_m=np.where(chosen, self._world.far_m, state.granted_to_m),
                wayside=state.wayside._replace(concerns=concerns),
            )
        made = super().plan(state, reports, earlier, longer_m)
        if wrong and failure.variant is Variant.RUN:
            further_m = failure.size * chosen[made.rows, np.newaxis]
            made = made._replace(front_m=made.front_m + further_m, ahead_m=made.ahead_m + further_m)
        return made
