"""The rules for single trains once more, in plain numbers, one train and step at a time."""

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2
from kankaku.railway.plan.world import World
from kankaku.railway.safety.examination import Clear
from kankaku.railway.safety.terms import Terms
from kankaku.railway.safety.train_steps import TrainSteps

NEVER = float("-inf")


class PlainStep:
    """A train, the line as its route meets it, and a step of it."""

    def __init__(
        self, world: World, terms: Terms, steps: TrainSteps, clear: Clear, at: tuple[int, int]
    ) -> None:
        column, step = at
        self.row = int(steps.rows[column])
        self.type = world.train_types[int(world.type_index[self.row])]
        self.line, self.curves = world.line_of(self.row), world.line.curves
        self.name = world.timetable.services[self.row].train_type
        self.terms, self.steps, self.clear, self.at = terms, steps, clear, at
        self.step_s, self.length_m = terms.step_s, self.type.length_m
        self.fronts_m = steps.front_m[column, step : step + 2].tolist()
        self.speeds_mps = steps.speed_mps[column, step : step + 2].tolist()
        self.eoa_m = steps.eoa_m[column, step : step + 2].tolist()
        self.delay_s = float(steps.delay_s[at])
        self.next_rear_m = float(clear.next_rear_m[column, step + 1])
        self.next_call = int(steps.next_call[column, step + 1])
        self.stop_m = float(world.stop_m[self.row, self.next_call])
        self.lost_mps2 = (self.speeds_mps[0] - self.speeds_mps[1]) / self.step_s
        self.brake_gravity = GRAVITY_MPS2 * self.type.brake_gravity_ratio

    def slope(self, front_m: float) -> float:
        """Front over tail, by the length."""
        ends_m = np.array([front_m - self.length_m, front_m])
        return float(np.diff(self.line.height_m(ends_m))[0]) / self.length_m

    def mean_height_m(self, front_m: float) -> float:
        """Over the train, from bend to bend."""
        bends = {edge for one in self.line.gradients for edge in (one.start_m, one.end_m)}
        bends.add(self.line.start_m)
        ends_m = front_m - self.length_m, front_m
        inside = sorted(bend for bend in bends if ends_m[0] < bend < ends_m[1])
        places_m = np.array([ends_m[0], *inside, ends_m[1]])
        return float(np.trapezoid(self.line.height_m(places_m), places_m)) / self.length_m

    def over_m(self, from_m: float, speed_mps: float, aim_m: float) -> float:
        """How much further than an aim the service brake takes a train."""
        lift_m = self.mean_height_m(aim_m) - self.mean_height_m(from_m)
        energy = 0.5 * speed_mps**2 - self.brake_gravity * lift_m
        return energy / self.type.service_brake_mps2 - (aim_m - from_m)

    def rising_m(self) -> float:
        """What the build-up of the brake adds: by its jerk, in thousandths of the build-up."""
        rate, build_up_s = self.type.service_brake_mps2, self.type.brake_build_up_s
        if build_up_s == 0.0:
            return 0.0
        whole = rate + self.brake_gravity * self.slope(self.fronts_m[1])
        gained = -self.lost_mps2
        rise_s = build_up_s * min(max((whole + gained) / rate, 0.0), 1.0)
        jerk = rate / build_up_s
        first = whole - jerk * rise_s
        speed = self.speeds_mps[1]
        then = speed - first * rise_s - jerk * rise_s**2 / 2.0
        if not then > 0.0:
            return 0.0
        risen_m = speed * rise_s - first * rise_s**2 / 2.0 - jerk * rise_s**3 / 6.0
        return float((whole * risen_m + (then**2 - speed**2) / 2.0) / rate)

    def hardest_mps2(self, rate_mps2: float, slope: float) -> float:
        """How much speed may go at a rate, on a gradient."""
        most = rate_mps2 + self.brake_gravity * slope
        if not self.type.net_brake:
            return most
        weight = GRAVITY_MPS2 * self.type.gravity_ratio
        sharpest_m = min((curve.radius_m for curve in self.curves), default=np.inf)
        pull = self.type.level_acceleration_mps2(np.array([max(self.speeds_mps)]))[0]
        climb = weight * (slope + self.type.curve_resistance_m / sharpest_m) - float(pull)
        return max(most, climb)

    def way_ahead(self) -> dict[str, float]:
        """Of authority, band and spacing."""
        (before_m, after_m), speed_mps = self.fronts_m, self.speeds_mps[1]
        ahead_m, rising_m = after_m + speed_mps * self.delay_s, self.rising_m()
        over_m = self.over_m(ahead_m, speed_mps, self.eoa_m[0]) + rising_m
        if self.terms.delay_s > 0.0:
            rise_m = self.mean_height_m(ahead_m) - self.mean_height_m(after_m)
            unlike_m = abs(rise_m - self.slope(after_m) * (ahead_m - after_m))
            over_m -= unlike_m * self.brake_gravity / self.type.service_brake_mps2
        excused = self.steps.surprised[self.at] or self.speeds_mps == [0.0, 0.0]
        return {
            "authority": NEVER if excused else over_m,
            "band": NEVER
            if self.terms.by_brakes
            else self.eoa_m[0] - max(self.next_rear_m, before_m),
            "spacing": self.over_m(after_m, speed_mps, self.next_rear_m) + rising_m,
        }

    def running(self) -> dict[str, float]:
        """Of stop, limit and acceleration."""
        (before_m, after_m), (before, after) = self.fronts_m, self.speeds_mps
        limits = [
            one.limit_mps
            for one in self.line.limits
            if one.train_type in {"", self.name}
            and one.start_m < after_m < one.end_m + self.length_m
        ]
        slopes = [self.slope(place) for place in (before_m, (before_m + after_m) / 2.0, after_m)]
        pull = float(self.type.level_acceleration_mps2(np.array([min(before, after)]))[0])
        pull -= GRAVITY_MPS2 * self.type.gravity_ratio * min(slopes)
        gained = -self.lost_mps2
        if self.steps.halting[self.at]:
            gained += min(before, 0.1) / self.step_s
        too_strong = gained - pull if after > 0.0 else NEVER
        too_hard = -gained - self.hardest_mps2(self.type.emergency_brake_mps2, max(slopes))
        stands = before == after == 0.0
        return {
            "stop": after_m - self.stop_m,
            "limit": after - min([*limits, self.type.maximum_speed_mps]),
            "acceleration": max(too_strong, NEVER if stands else too_hard),
        }

    def handling(self) -> dict[str, float]:
        """Of braking, validity and idle."""
        (before_m, after_m), (before, after) = self.fronts_m, self.speeds_mps
        steps, (column, step), terms = self.steps, self.at, self.terms
        slopes = self.slope(before_m - 1.0), self.slope(after_m + 1.0)
        harder = self.lost_mps2 - self.hardest_mps2(self.type.service_brake_mps2, max(slopes))
        over_m = self.over_m(before_m + before * self.delay_s, before, self.eoa_m[0])
        may = steps.emergency[self.at] or steps.halting[self.at] or (harder > 0.02 and over_m >= -1)
        since_s = steps.time_s[step] - steps.heard_s[self.at] - terms.validity_s - 1e-3
        built = min(since_s / max(self.type.brake_build_up_s, 1e-3), 1.0)
        weaker = built * self.type.emergency_brake_mps2 + self.brake_gravity * min(slopes)
        brakes_enough = after == 0.0 or steps.halting[self.at] or not since_s > 0.0
        passed = [
            own
            for place, own in zip(terms.boundaries_m, terms.enters[self.row], strict=True)
            if before_m <= place < after_m
        ]
        enters = passed and passed[0] and not steps.surprised[column, step + 1]
        idled_m = after_m + terms.idle_time_s * after
        return {
            "braking": NEVER if may else harder,
            "validity": NEVER if brakes_enough else weaker - self.lost_mps2,
            "idle": self.over_m(idled_m, after, self.eoa_m[1])
            if enters and terms.idle_time_s
            else NEVER,
        }

    def permission(self) -> dict[str, float]:
        """Of margin, grant, release and platform."""
        terms, clear, eoa_m, front_m = self.terms, self.clear, self.eoa_m[0], self.fronts_m[0]
        passed_m = [place for place in terms.balises_m.tolist() if place <= min(eoa_m, front_m)]
        last_m = max(passed_m, default=terms.balises_m[0])
        reach_m = eoa_m + terms.error_ratio * max(eoa_m - last_m, 0.0)
        reach_m += terms.resolution_m + terms.margin_m
        if eoa_m <= front_m:
            reach_m = NEVER
        behind_m = float(clear.buffered_m[self.at])
        free_to_m = {
            "margin": np.inf if behind_m >= terms.far_m else behind_m,
            "grant": clear.granted_m[self.at],
            "release": clear.unreleased_m[self.at],
            "platform": clear.platform_m[self.at],
        }
        return {kind: float(reach_m - place_m) for kind, place_m in free_to_m.items()}


def excesses(
    world: World, terms: Terms, steps: TrainSteps, clear: Clear, at: tuple[int, int]
) -> dict[str, float]:
    """Return by how much a train breaks each rule in a step; (column, step)."""
    plain = PlainStep(world, terms, steps, clear, at)
    found = plain.permission() if terms.promised else {}
    if steps.moving[at]:
        found |= plain.way_ahead() | plain.running()
        if terms.promised and not found["acceleration"] > 0.02:
            found |= plain.handling()
    return found
