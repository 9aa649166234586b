"""
The run of least electrical energy plus a price on time, after Pontryagin's principle.

Let ``p`` be what a unit of kinetic energy is worth to the rest of the run. A train speeds up
while ``p`` is above the price ``1 / eta`` of a unit from the wire, holds a speed where both are
equal, coasts while ``p`` lies between that and what the electric brake brings back, brakes
electrically with all it has down to ``p = 0``, and then with the service brake. Without traction
``p`` falls as ``dp/dx = p R'(v) / (M v) - c / v^3`` with the price of time ``c``; where it is
held, ``c = V^2 R'(V) / (M eta)``, one speed for the whole line. So all that is to be found are the
places where coasting begins: too early, and ``p`` is used up before the brake curve; too late,
and the train meets it with energy that is still worth something.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.motion.acceleration import accelerations, energy_gain
from kankaku.railway.motion.electric_brake import electric_brake_n
from kankaku.railway.motion.way import Way
from kankaku.railway.plan.rolling_stock import TrainType

SPEEDING_UP, HOLDING, COASTING, ELECTRIC, BRAKING = range(5)
"""What a train does in a cell; braking is along the cap of the way."""
REGAINED = 1e3
"""Stands for a worth that is back where traction pays."""
SCAN = 8
"""Parts into which a stretch is cut in search of where coasting may begin."""
NEAR_CELLS = 1e-3
"""How exactly the start of coasting can be found, in cells of a metre."""
LEFT_OVER = 1e-3
"""So much worth may be left at a brake curve. [-]"""
SLACK = 1e-6
"""Rounding allowed to a worth. [-]"""


class Rates(NamedTuple):
    """What a train can do and what it costs, per unit of inertial mass."""

    resistance: tuple[float, float, float]
    """Constant, linear and square term. [m/s2], [1/s], [1/m]"""
    electric: tuple[float, float, float]
    """Greatest rate [m/s2], power [W/kg] and cutoff speed [m/s] of the electric brake."""
    service_brake_mps2: float
    net_brake: float
    """1 where gradients and curves are part of the service brake; else 0. [-]"""
    bought: float
    """Energy from the wire for a unit of work of traction. [-]"""
    sold: float
    """Energy brought back for a unit of work of the electric brake. [-]"""
    price_wpkg: float
    """Price of time. [W/kg]"""
    hold_m2ps2: float
    """Half the square of the speed that is held where nothing else binds. [m2/s2]"""


class Extremal(NamedTuple):
    """A run along a way."""

    energy_m2ps2: FloatArray
    """Half the square of the speed. [m2/s2], shape (n_points,)"""
    phase: IntArray
    """What the train does in each cell. shape (n_points - 1,)"""
    run_time_s: float
    """Infinite if it cannot climb the line. [s]"""


def rates_of(train_type: TrainType, price_wpkg: float) -> Rates:
    """
    Return the rates of a train.

    Parameters
    ----------
    train_type
        The train.
    price_wpkg
        Price of time, per unit of inertial mass. [W/kg]

    Returns
    -------
    Rates
        Its rates.
    """
    mass_kg, supply = train_type.inertial_mass_kg, train_type.supply
    resistance = train_type.resistance
    return Rates(
        (
            resistance.a_n / mass_kg,
            resistance.b_nspm / mass_kg,
            resistance.c_ns2pm2 / mass_kg,
        ),
        (
            supply.regeneration_force_n / mass_kg,
            supply.regeneration_power_w / mass_kg,
            supply.regeneration_cutoff_mps,
        ),
        train_type.service_brake_mps2,
        float(train_type.net_brake),
        1.0 / supply.traction_efficiency,
        supply.regeneration_efficiency,
        price_wpkg,
        0.5 * holding_speed_mps(train_type, price_wpkg) ** 2,
    )


def holding_speed_mps(train_type: TrainType, price_wpkg: float) -> float:
    """
    Return the speed that is held where nothing else binds.

    Parameters
    ----------
    train_type
        The train.
    price_wpkg
        Price of time, per unit of inertial mass. [W/kg]

    Returns
    -------
    float
        The speed; infinite if the resistance does not rise with it. [m/s]

    References
    ----------
    .. [1] Howlett and Pudney, Energy-Efficient Train Control, 1995: ``V^2 R'(V)`` is the price.
    """
    resistance = train_type.resistance
    power_w = price_wpkg * train_type.inertial_mass_kg * train_type.supply.traction_efficiency
    roots = np.roots([2.0 * resistance.c_ns2pm2, resistance.b_nspm, 0.0, -power_w])
    rising = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0)]
    return float(rising[0]) if rising.size else np.inf


def extremal(way: Way, price_wpkg: float) -> Extremal:
    """
    Return the run that the principle allows at a price of time.

    Parameters
    ----------
    way
        The way.
    price_wpkg
        Price of time, per unit of inertial mass. [W/kg]

    Returns
    -------
    Extremal
        The run.
    """
    pull, coast = accelerations(way.train_type)
    return Extremal(
        *_run(
            way.chainage_m,
            way.cap_m2ps2,
            way.drag_mps2,
            pull,
            coast,
            rates_of(way.train_type, price_wpkg),
            0.5 * way.start_mps**2,
        )
    )


@compiled
def _run(  # noqa: PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    cap: FloatArray,
    drag: FloatArray,
    pull: FloatArray,
    coast: FloatArray,
    rates: Rates,
    start: float,
) -> tuple[FloatArray, IntArray, float]:
    points = chainage_m.size
    energy, trial = np.zeros(points), np.zeros(points)
    phase = np.empty(points - 1, dtype=np.intp)
    tried = np.empty(points - 1, dtype=np.intp)
    energy[0] = start
    here = 0
    while here < points - 1:
        here = _braked(chainage_m, cap, drag, coast, rates, here, energy, phase, True)
        held = _braked(chainage_m, cap, drag, coast, rates, here, energy, phase, False)
        last, worth = held, rates.sold
        if held == here:
            last = _powered(chainage_m, cap, drag, pull, coast, rates, here, energy, phase)
            worth = rates.bought
        if last < 0:
            return energy, phase, np.inf
        switch = _switch(chainage_m, cap, drag, rates, here, last, worth, energy, trial, tried)
        if switch > last - here:
            here = last
        else:
            first = here + int(max(switch, 0.0))
            _, here = _let_go(
                chainage_m, cap, drag, rates, here, switch, worth, energy, trial, tried
            )
            energy[first + 1 : here + 1] = trial[first + 1 : here + 1]
            phase[first:here] = tried[first:here]
    time_s = 0.0
    for cell in range(points - 1):
        both_mps = np.sqrt(2.0 * energy[cell]) + np.sqrt(2.0 * energy[cell + 1])
        if both_mps <= 0.0:
            return energy, phase, np.inf
        time_s += 2.0 * (chainage_m[cell + 1] - chainage_m[cell]) / both_mps
    return energy, phase, time_s


@formula
def _powered(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    cap: FloatArray,
    drag: FloatArray,
    pull: FloatArray,
    coast: FloatArray,
    rates: Rates,
    here: int,
    energy: FloatArray,
    phase: IntArray,
) -> int:
    """Speed up and hold as far as no brake is needed; return in which cell it is, -1 on a stall."""
    cells = chainage_m.size - 1
    for cell in range(here, cells):
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        drags = drag[cell], drag[cell + 1]
        coasted = energy[cell] + energy_gain(coast, energy[cell], step_m, drags)
        if coasted > cap[cell + 1]:
            return cell
        ahead = energy[cell] + energy_gain(pull, energy[cell], step_m, drags)
        top = max(min(rates.hold_m2ps2, cap[cell + 1]), coasted)
        phase[cell] = SPEEDING_UP if ahead < top else HOLDING
        energy[cell + 1] = min(ahead, top)
        if energy[cell + 1] <= 0.0 and cell < cells - 1:
            return -1
    return cells


@formula
def _braked(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    cap: FloatArray,
    drag: FloatArray,
    coast: FloatArray,
    rates: Rates,
    here: int,
    energy: FloatArray,
    phase: IntArray,
    friction: bool,
) -> int:
    """Brake along the cap, by the electric brake alone or not; return in which cell that ends."""
    rate, power, cutoff_mps = rates.electric
    for cell in range(here, chainage_m.size - 1):
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        drags = drag[cell], drag[cell + 1]
        excess = energy[cell] + energy_gain(coast, energy[cell], step_m, drags) - cap[cell + 1]
        electric = electric_brake_n(np.sqrt(2.0 * energy[cell]), rate, power, cutoff_mps)
        if excess <= 0.0 or (excess > step_m * electric) != friction:
            return cell
        energy[cell + 1] = cap[cell + 1]
        phase[cell] = BRAKING
    return chainage_m.size - 1


@formula
def _switch(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    cap: FloatArray,
    drag: FloatArray,
    rates: Rates,
    here: int,
    last: int,
    worth: float,
    energy: FloatArray,
    trial: FloatArray,
    tried: IntArray,
) -> float:
    """
    Return where coasting begins, in cells from here.

    Below 0 it begins at once, with a worth that is lower by that share; infinite if nowhere.
    """
    low, high, under = -1.0, 0.0, -1.0
    left, _ = _let_go(chainage_m, cap, drag, rates, here, 0.0, worth, energy, trial, tried)
    if left < 0.0 or left == REGAINED:
        for part in range(1, SCAN + 1):
            low, under, high = high, left, (last - here) * part / SCAN
            left, _ = _let_go(chainage_m, cap, drag, rates, here, high, worth, energy, trial, tried)
            if 0.0 < left < REGAINED or (left == REGAINED and under < 0.0):
                break
        else:
            return np.inf
    # Regula falsi; an end that stays counts half the next time (Illinois).
    under, over = min(under, -LEFT_OVER), min(left, rates.bought)
    while high - low > NEAR_CELLS and left > LEFT_OVER:
        middle = low + max(min(under / (under - over), 0.95), 0.05) * (high - low)
        found, _ = _let_go(chainage_m, cap, drag, rates, here, middle, worth, energy, trial, tried)
        if found < 0.0:
            low, under, over = middle, found, 0.5 * over
        else:
            high, left = middle, found
            under, over = 0.5 * under, min(found, rates.bought)
    return high


@formula
def _let_go(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    cap: FloatArray,
    drag: FloatArray,
    rates: Rates,
    here: int,
    switch: float,
    worth: float,
    energy: FloatArray,
    trial: FloatArray,
    tried: IntArray,
) -> tuple[float, int]:
    """
    Coast and brake electrically from a switch on.

    Returns how much worth is left at a brake curve, or how far below it the worth is used up
    (negative), or ``REGAINED``; and at which point.
    """
    first = here + int(max(switch, 0.0))
    worth *= 1.0 + min(switch, 0.0)
    part = max(switch, 0.0) - int(max(switch, 0.0))
    now = energy[first]
    if part > 0.0:
        now += part * (energy[first + 1] - now)
    slowest = 0.5 * rates.electric[2] ** 2
    for cell in range(first, chainage_m.size - 1):
        step_m = (1.0 - part) * (chainage_m[cell + 1] - chainage_m[cell])
        part = 0.0
        room, before, top = cap[cell] - now, worth, cap[cell + 1]
        tried[cell] = ELECTRIC if worth < rates.sold else COASTING
        grade = 0.5 * (drag[cell] + drag[cell + 1])
        now, worth = _over_a_cell(rates, now, worth, step_m, grade)
        trial[cell + 1] = min(now, top)
        if now >= top and now - top + room > 0.0:
            worth += (before - worth) * (now - top) / (now - top + room)
        # Too slow for the electric brake, energy is worth no more than time.
        if worth <= 0.0 or now <= 0.0 or (worth < rates.sold and now < min(slowest, top)):
            return -max(top - now, LEFT_OVER) / (top + 1.0), cell + 1
        if now >= top:
            return worth - (
                rates.sold if _holds(rates, cap[cell], top, step_m, grade) else 0.0
            ), cell + 1
        if worth > rates.bought * (1.0 + SLACK):
            return REGAINED, cell + 1
    return worth, chainage_m.size - 1


@formula
def _holds(rates: Rates, energy: float, ahead: float, step_m: float, drag: float) -> bool:
    """Tell whether the electric brake alone is enough over a cell."""
    braked, _ = _over_a_step(rates, energy, 0.0, step_m, drag, True)
    return braked <= ahead


@formula
def _over_a_cell(
    rates: Rates, energy: float, worth: float, step_m: float, drag: float
) -> tuple[float, float]:
    """Return energy and worth behind a cell; the brake sets in, or lets go, within it."""
    brakes = worth < rates.sold
    ahead, then = _over_a_step(rates, energy, worth, step_m, drag, brakes)
    if brakes == (then < rates.sold):
        return ahead, then
    part = (worth - rates.sold) / (worth - then)
    energy, worth = _over_a_step(rates, energy, worth, part * step_m, drag, brakes)
    return _over_a_step(rates, energy, worth, (1.0 - part) * step_m, drag, not brakes)


@formula
def _over_a_step(
    rates: Rates, energy: float, worth: float, step_m: float, drag: float, brakes: bool
) -> tuple[float, float]:
    speed_mps = np.sqrt(2.0 * energy) + 1e-6
    inverse = 1.0 / speed_mps
    constant, linear, square = rates.resistance
    loss = constant + (linear + square * speed_mps) * speed_mps
    # How the loss rises with the energy, and the part of it that is sold.
    rise, sold = linear * inverse + 2.0 * square, 0.0
    if brakes:
        rate, power, cutoff_mps = rates.electric
        electric: float = electric_brake_n(speed_mps, rate, power, cutoff_mps)  # type: ignore[assignment]
        taken = loss + rates.net_brake * drag
        loss += max(min(electric, rates.service_brake_mps2 - taken), 0.0)
        if electric < rate:
            sold = -electric * inverse * inverse
    slope = -loss - drag
    gain = step_m * slope * (1.0 - 0.5 * step_m * (rise + sold))
    middle = inverse * (1.0 - 0.5 * step_m * slope * inverse * inverse)
    worth_slope = worth * rise - (rates.sold - worth) * sold - rates.price_wpkg * middle**3
    return max(energy + gain, 0.0), worth + step_m * worth_slope
