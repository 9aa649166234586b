"""Energy: traction, braking, regeneration and auxiliaries, closed by a work-energy balance."""

from collections.abc import Mapping

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
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


class EnergyMeter:
    """Adds up the work of every train, block of steps by block of steps."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._sums = {name: np.zeros(world.size) for name in MEASURED}
        self._inertia_kg = world.of_type("inertial_mass_kg")
        kinds = [world.train_types[row] for row in world.type_index]
        self._resistance = np.array(
            [(k.resistance.a_n, k.resistance.b_nspm, k.resistance.c_ns2pm2) for k in kinds]
        ).T
        self._supply = np.array(
            [
                (
                    kind.supply.regeneration_force_n,
                    kind.supply.regeneration_power_w,
                    kind.supply.regeneration_cutoff_mps,
                )
                for kind in kinds
            ]
        ).T
        self._auxiliary_w = np.array([kind.supply.auxiliary_w for kind in kinds])
        self._traction_efficiency = np.array([kind.supply.traction_efficiency for kind in kinds])
        self._regeneration_efficiency = np.array(
            [kind.supply.regeneration_efficiency for kind in kinds]
        )

    def add(self, block: StepBlock) -> None:
        """
        Account for a block of steps.

        Parameters
        ----------
        block
            The steps.
        """
        rows = block.rows
        inertia_kg = self._inertia_kg[rows]
        before, after = block.speed_mps[:-1], block.speed_mps[1:]
        mean_mps = 0.5 * (before + after)
        distance_m = np.where(block.moving, np.diff(block.front_m, axis=0), 0.0)
        middle_m = block.front_m[:-1] + 0.5 * distance_m
        profile, kinds = self._world.profile, self._world.type_index[rows]
        drag_n = inertia_kg * profile.drag_at_mps2(kinds, middle_m)
        curves_n = inertia_kg * profile.curve_drag_at_mps2(kinds, middle_m)
        rise_m2ps2 = np.diff(profile.lift_at_m2ps2(kinds, block.front_m), axis=0)
        rolling_n = self._rolling_n(mean_mps, rows)
        inertia_n = inertia_kg * (after - before) / self._world.step_s
        work_j = (inertia_n + drag_n + rolling_n) * distance_m
        kinetic_j = 0.5 * inertia_kg * (np.square(after) - np.square(before))
        added = {
            "distance_m": distance_m,
            "traction_j": np.maximum(work_j, 0.0),
            "braking_j": np.maximum(-work_j, 0.0),
            "resistance_j": (rolling_n + curves_n) * distance_m,
            "potential_j": np.where(block.moving, inertia_kg * rise_m2ps2, 0.0),
            "kinetic_j": np.where(block.moving, kinetic_j, 0.0),
            "regenerated_j": self._regenerated_j(work_j, distance_m, mean_mps, rows),
            "auxiliary_j": block.present * (self._world.step_s * self._auxiliary_w[rows]),
        }
        for name, values in added.items():
            self._sums[name][rows] += values.sum(axis=0)

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
        sums = self._sums
        return EnergyAccount(
            **sums,
            consumed_j=sums["traction_j"] / self._traction_efficiency + sums["auxiliary_j"],
            recovered_j=sums["regenerated_j"] * self._regeneration_efficiency,
        )

    def _rolling_n(self, speed_mps: FloatArray, rows: IntArray) -> FloatArray:
        a_n, b_nspm, c_ns2pm2 = self._resistance[:, rows]
        rolling: FloatArray = a_n + (b_nspm + c_ns2pm2 * speed_mps) * speed_mps
        return rolling

    def _regenerated_j(
        self, work_j: FloatArray, distance_m: FloatArray, speed_mps: FloatArray, rows: IntArray
    ) -> FloatArray:
        force_n, power_w, cutoff_mps = self._supply[:, rows]
        electric_n = electric_brake_n(speed_mps, force_n, power_w, cutoff_mps)
        return np.minimum(np.maximum(-work_j, 0.0), electric_n * distance_m)
