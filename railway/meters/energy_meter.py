"""Energy: traction, braking, regeneration and auxiliaries, closed by a work-energy balance."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, interpolated, plain
from kankaku.railway.motion.electric_brake import electric_brake_n
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import EnergyAccount
from kankaku.railway.step.step_block import StepBlock

MEASURED = (
    "distance_m",
    "traction_j",
    "braking_j",
    "resistance_j",
    "potential_j",
    "kinetic_j",
    "regenerated_j",
    "auxiliary_j",
)
DISTANCE, TRACTION, BRAKING, RESISTANCE, POTENTIAL, KINETIC, REGENERATED, AUXILIARY = range(
    len(MEASURED)
)


class _Stock(NamedTuple):
    """What forces and energy of trains follow from; arrays of shape (n_trains,)."""

    inertia_kg: FloatArray
    resistance: FloatArray
    """Coefficients of the running resistance. [N], [N s/m], [N s2/m2], shape (n_trains, 3)"""
    electric: FloatArray
    """Greatest force and power of the electric brake, and where it ends. [N], [W], [m/s]"""
    auxiliary_w: FloatArray
    row_start: FloatArray
    """Turns a place into one of the tables of the line."""


class _AlongLine(NamedTuple):
    """Tables of the line, one train type after the other; of shape (n_types * n_grid,)."""

    drag_mps2: FloatArray
    curve_drag_mps2: FloatArray
    lift_m2ps2: FloatArray


class EnergyMeter:
    """Adds up the work of every train, block of steps by block of steps."""

    def __init__(self, world: World) -> None:
        self._step_s = world.step_s
        self._sums = np.zeros((len(MEASURED), world.size))
        kinds = [world.train_types[row] for row in world.type_index]
        resistance = [(k.resistance.a_n, k.resistance.b_nspm, k.resistance.c_ns2pm2) for k in kinds]
        supplies = [kind.supply for kind in kinds]
        electric = [
            (one.regeneration_force_n, one.regeneration_power_w, one.regeneration_cutoff_mps)
            for one in supplies
        ]
        profile = world.profile
        self._stock = plain(
            _Stock(
                world.of_type("inertial_mass_kg"),
                np.array(resistance),
                np.array(electric),
                np.array([one.auxiliary_w for one in supplies]),
                profile.row_starts(world.type_index),
            )
        )
        self._way = plain(
            _AlongLine(profile.drags_mps2, profile.curve_drags_mps2, profile.lifts_m2ps2)
        )
        self._traction_efficiency = np.array([one.traction_efficiency for one in supplies])
        self._regeneration_efficiency = np.array([one.regeneration_efficiency for one in supplies])

    def add(self, block: StepBlock) -> None:
        """
        Account for a block of steps.

        Parameters
        ----------
        block
            The steps.
        """
        seen = block.front_m, block.speed_mps, block.present, block.moving
        _add(block.rows, seen, self._stock, self._way, (self._step_s, self._sums))

    def measured(self) -> Mapping[str, EnergyAccount]:
        """
        Return what was measured.

        Returns
        -------
        Mapping[str, EnergyAccount]
            By field of :class:`~kankaku.railway.step.records.RunRecord`.
        """
        return {"energy": self.account()}

    def account(self) -> EnergyAccount:
        """
        Return the account so far.

        Returns
        -------
        EnergyAccount
            Work and energy of every train.
        """
        sums = dict(zip(MEASURED, self._sums.copy(), strict=True))
        return EnergyAccount(
            **sums,
            consumed_j=sums["traction_j"] / self._traction_efficiency + sums["auxiliary_j"],
            recovered_j=sums["regenerated_j"] * self._regeneration_efficiency,
        )


@formula
def _add(
    rows: IntArray,
    seen: tuple[FloatArray, FloatArray, BoolArray, BoolArray],
    stock_fields: Plain,
    way_fields: Plain,
    accounted: tuple[float, FloatArray],
) -> None:
    """
    Add the work of a block of steps of constant acceleration.

    Of every step: the train's resistance at its mean speed, the line's at the middle of the way.
    """
    (fronts_m, speeds_mps, present, moving), (step_s, sums) = seen, accounted
    stock, way = _Stock(*stock_fields), _AlongLine(*way_fields)
    for column in range(rows.size):
        train = rows[column]
        inertia_kg, start = stock.inertia_kg[train], stock.row_start[train]
        a_n, b_nspm, c_ns2pm2 = stock.resistance[train]
        force_n, power_w, cutoff_mps = stock.electric[train]
        for step in range(moving.shape[0]):
            if present[step, column]:
                sums[AUXILIARY, train] += step_s * stock.auxiliary_w[train]
            if not moving[step, column]:
                continue
            here_m, there_m = fronts_m[step, column], fronts_m[step + 1, column]
            before, after = speeds_mps[step, column], speeds_mps[step + 1, column]
            distance_m, mean_mps = there_m - here_m, 0.5 * (before + after)
            middle = here_m + 0.5 * distance_m + start
            drag_n = inertia_kg * interpolated(way.drag_mps2, middle)
            curves_n = inertia_kg * interpolated(way.curve_drag_mps2, middle)
            rise = interpolated(way.lift_m2ps2, there_m + start)
            rise -= interpolated(way.lift_m2ps2, here_m + start)
            rolling_n = a_n + (b_nspm + c_ns2pm2 * mean_mps) * mean_mps
            work_j = (inertia_kg * (after - before) / step_s + drag_n + rolling_n) * distance_m
            electric_j = electric_brake_n(mean_mps, force_n, power_w, cutoff_mps) * distance_m
            sums[DISTANCE, train] += distance_m
            sums[TRACTION, train] += max(work_j, 0.0)
            sums[BRAKING, train] += max(-work_j, 0.0)
            sums[RESISTANCE, train] += (rolling_n + curves_n) * distance_m
            sums[POTENTIAL, train] += inertia_kg * rise
            sums[KINETIC, train] += 0.5 * inertia_kg * (after * after - before * before)
            sums[REGENERATED, train] += min(max(-work_j, 0.0), electric_j)
