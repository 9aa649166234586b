"""Train types: traction, running resistance, braking, masses, lengths, and electrical losses."""

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray
from kankaku.railway.plan.line import CURVE_RESISTANCE_M


@dataclass(frozen=True, slots=True)
class Traction:
    """
    Wheel force against speed in three regions.

    Constant force up to ``power_speed_mps``, then constant power up to
    ``characteristic_speed_mps``, then falling with the square of the speed.
    """

    starting_force_n: float
    power_speed_mps: float
    characteristic_speed_mps: float

    def scaled(self, share: float) -> "Traction":
        """
        Return the traction of a train of which a share is used.

        Parameters
        ----------
        share
            Of the force at any speed. [-]

        Returns
        -------
        Traction
            The same where all is used.
        """
        return replace(self, starting_force_n=share * self.starting_force_n)

    @property
    def bends_mps(self) -> tuple[float, ...]:
        """Speeds at which the force bends. [m/s]"""
        bends = self.power_speed_mps, self.characteristic_speed_mps
        return tuple(speed for speed in bends if np.isfinite(speed))

    def force_n(self, speed_mps: FloatArray) -> FloatArray:
        """
        Return the greatest tractive force.

        Parameters
        ----------
        speed_mps
            Speed. [m/s], any shape

        Returns
        -------
        FloatArray
            Force at the wheel rim. [N], same shape
        """
        speed = np.maximum(speed_mps, 1e-9)
        constant_power = np.minimum(1.0, self.power_speed_mps / speed)
        falling = np.minimum(1.0, self.characteristic_speed_mps / speed)
        return self.starting_force_n * constant_power * falling


@dataclass(frozen=True, slots=True)
class ForceTable:
    """Wheel force against speed: linear between the speeds of a table, the last force held."""

    speeds_mps: tuple[float, ...]
    """Rising from 0. [m/s], length n"""
    forces_n: tuple[float, ...]
    """At these speeds. [N], length n"""

    def scaled(self, share: float) -> "ForceTable":
        """
        Return the traction of a train of which a share is used.

        Parameters
        ----------
        share
            Of the force at any speed. [-]

        Returns
        -------
        ForceTable
            The same where all is used.
        """
        return ForceTable(self.speeds_mps, tuple(share * force_n for force_n in self.forces_n))

    @property
    def starting_force_n(self) -> float:
        """Force at rest. [N]"""
        return self.forces_n[0]

    @property
    def bends_mps(self) -> tuple[float, ...]:
        """Speeds at which the force bends. [m/s]"""
        return self.speeds_mps

    def force_n(self, speed_mps: FloatArray) -> FloatArray:
        """
        Return the greatest tractive force.

        Parameters
        ----------
        speed_mps
            Speed. [m/s], any shape

        Returns
        -------
        FloatArray
            Force at the wheel rim. [N], same shape
        """
        return np.interp(speed_mps, self.speeds_mps, self.forces_n)


AnyTraction: TypeAlias = Traction | ForceTable
"""Wheel force against speed, however it is told."""


@dataclass(frozen=True, slots=True)
class RunningResistance:
    """Resistance on level straight track: ``a + b v + c v^2``, in N, N s/m and N s2/m2."""

    a_n: float
    b_nspm: float
    c_ns2pm2: float

    def force_n(self, speed_mps: FloatArray) -> FloatArray:
        """
        Return the running resistance.

        Parameters
        ----------
        speed_mps
            Speed. [m/s], any shape

        Returns
        -------
        FloatArray
            Force against the motion. [N], same shape
        """
        return self.a_n + (self.b_nspm + self.c_ns2pm2 * speed_mps) * speed_mps


def handbook_resistance(
    motor_mass_kg: float, trailer_mass_kg: float, cars: int
) -> RunningResistance:
    """
    Return the handbook formula of running resistance for an electric multiple unit.

    In kgf with V in km/h and masses in t it reads
    ``(1.65 + 0.0247 V) M_M + (0.78 + 0.0028 V) M_T + (0.028 + 0.0078 (n - 1)) V^2``.

    Parameters
    ----------
    motor_mass_kg
        Mass of all motor cars. [kg]
    trailer_mass_kg
        Mass of all trailer cars. [kg]
    cars
        Number of cars. [-]

    Returns
    -------
    RunningResistance
        The same formula in SI units.

    References
    ----------
    .. [1] Electric Railway Handbook, Corona, 2007, as used by Sakai et al. 2020, fig. 6.
    """
    motor_t = motor_mass_kg / 1000.0
    trailer_t = trailer_mass_kg / 1000.0
    kmh_per_mps = 3.6
    return RunningResistance(
        a_n=GRAVITY_MPS2 * (1.65 * motor_t + 0.78 * trailer_t),
        b_nspm=GRAVITY_MPS2 * kmh_per_mps * (0.0247 * motor_t + 0.0028 * trailer_t),
        c_ns2pm2=GRAVITY_MPS2 * kmh_per_mps**2 * (0.028 + 0.0078 * (cars - 1)),
    )


@dataclass(frozen=True, slots=True)
class PowerSupply:
    """Losses between wire and wheel, regeneration and auxiliaries."""

    traction_efficiency: float
    regeneration_efficiency: float
    regeneration_force_n: float
    """Greatest electric braking force; the rest of the braking is friction. [N]"""
    regeneration_power_w: float
    """Greatest electric braking power at the wheel. [W]"""
    regeneration_cutoff_mps: float
    """Below this speed the electric brake fades out and nothing is recovered. [m/s]"""
    auxiliary_w: float


@dataclass(frozen=True, slots=True)
class TrainType:
    """All that the physics needs to know about a train."""

    id: str
    cars: int
    length_m: float
    mass_kg: float
    rotating_mass_ratio: float
    """Equivalent mass of the rotating parts over the mass. [-]"""
    traction: AnyTraction
    resistance: RunningResistance
    service_brake_mps2: float
    emergency_brake_mps2: float
    maximum_speed_mps: float
    supply: PowerSupply
    jerk_mps3: float = float("inf")
    """Greatest change of the acceleration with traction and service brake. [m/s3]"""
    brake_build_up_s: float = 0.0
    """From nothing to the whole brake, service or emergency; the force rises evenly. [s]"""
    safety_factor: float = 1.0
    """Braking distances count as so many times what they are where safety needs them. [-]"""
    overspeed_mps: float = 0.0
    """A train counts as so much faster where safety needs its braking distance. [m/s]"""
    curve_resistance_m: float = CURVE_RESISTANCE_M
    """Curve resistance over weight, times the radius. [m]"""
    net_brake: bool = False
    """Brake rates are reached on any gradient; else they hold on the level, and gravity adds."""

    @property
    def inertial_mass_kg(self) -> float:
        """Mass including the rotating parts. [kg]"""
        return self.mass_kg * (1.0 + self.rotating_mass_ratio)

    @property
    def gravity_ratio(self) -> float:
        """Share of a gradient's pull that accelerates the train, rotating parts counted. [-]"""
        return 1.0 / (1.0 + self.rotating_mass_ratio)

    @property
    def brake_rise_s(self) -> float:
        """From nothing to the whole service brake, the jerk limit kept. [s]"""
        return max(self.brake_build_up_s, self.service_brake_mps2 / self.jerk_mps3)

    @property
    def brake_gravity_ratio(self) -> float:
        """Share of a gradient's pull that adds to the rate of a brake. [-]"""
        return 0.0 if self.net_brake else self.gravity_ratio

    @property
    def starting_acceleration_mps2(self) -> float:
        """Greatest acceleration from rest on level straight track. [m/s2]"""
        return float(self.level_acceleration_mps2(np.zeros(1))[0])

    def level_acceleration_mps2(self, speed_mps: FloatArray) -> FloatArray:
        """
        Return the greatest acceleration on level straight track.

        Parameters
        ----------
        speed_mps
            Speed. [m/s], any shape

        Returns
        -------
        FloatArray
            Acceleration. [m/s2], same shape
        """
        net_n = self.traction.force_n(speed_mps) - self.resistance.force_n(speed_mps)
        return net_n / self.inertial_mass_kg
