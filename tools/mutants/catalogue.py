"""The mutants: which text of which file stands for which other one."""

from typing import NamedTuple

PROFILE = "railway/plan/profile.py"
LEADERS = "railway/wayside/leaders.py"
PASSING = "railway/plan/passing.py"
TURNS = "railway/plan/turns.py"
POINT_MACHINE = "railway/wayside/point_machine.py"
LEVEL_CROSSING = "railway/wayside/level_crossing.py"
LOOKING = "railway/wayside/looking.py"
DRIVE = "controllers/drive.py"
STOCK = "scenarios/binding/rolling_stock.toml"
EMERGENCY_BRAKE = "emergency_brake_kmhps = 4.0"
BUILDS_UP = "rising_speed_mps(speed + over, room, (loss, lag), rise, pulled + over)"
MOVING_BLOCK = "controllers/protection/moving_block.py"
OVER_RADIO = "controllers/centre/over_radio.py"
MAP_STEPS = "controllers/control_map/map_steps.py"
TELEGRAMS = "controllers/control_map/telegrams.py"
CHAINED = "tuple(last_on.get(track, NO_PREDECESSOR) for track in service.route)"
CLEARED = "found.append(Passage(name, entry_m, fouling_m[1], turnout))"
BRAKE = "train.service_brake_mps2 * (grid_m - origin_m)"
TAIL = "tail_m = front_m - self._world.length_m"
TOUCHED = (
    "[train]:\n            circuit = circuits.piece[place]\n            touched_s[circuit] = time_s"
)
EMERGENCY = "brakes = emergency(memory.emergency, state, radio.heard_s, HORIZON_S)"


class Patch(NamedTuple):
    """One text that stands for another one; the old one is there exactly once."""

    file: str
    old: str
    new: str


class Mutant(NamedTuple):
    """A fault, and the controllers of the scenario that it is to be seen under."""

    name: str
    controllers: tuple[str, ...]
    patches: tuple[Patch, ...]
    scenario: str = "binding"


def _mutant(name: str, controllers: str, *patches: tuple[str, str, str]) -> Mutant:
    return Mutant(name, tuple(controllers.split()), tuple(Patch(*patch) for patch in patches))


NETWORK: tuple[Mutant, ...] = tuple(
    mutant._replace(scenario="binding_network")
    for mutant in (
        _mutant(
            "opposing trains not waited for",
            "moving",
            (
                TURNS,
                "waits[row][number].update(ones if other != way else ())",
                "waits[row][number].update(ones if other == () else ())",
            ),
            (
                TURNS,
                "if clash[way, other]:",
                "if clash[way, other] and line.track_by_id[way[1]].direction < 0:",
            ),
        ),
        _mutant(
            "conflicting ways not waited for",
            "moving atc",
            (TURNS, "if clash[way, other]:", "if False:"),
        ),
        _mutant(
            "ways that cross taken for parallel",
            "moving",
            (PASSING, "return before * behind <= 0.0", "return False"),
        ),
        _mutant(
            "points thrown in no time",
            "moving atd",
            (LEADERS, "throw_s = self._throw_s[turnout] if turnout >= 0 else 0.0", "throw_s = 0.0"),
        ),
        _mutant(
            "points of a network released by the front",
            "moving",
            (PASSING, CLEARED, CLEARED.replace("fouling_m[1]", "fouling_m[1] - 200.0")),
        ),
        _mutant(
            "turn-back in no time",
            "moving",
            (
                "scenarios/loading/load_timetable.py",
                "minimum_dwell_s=max(begins.minimum_dwell_s, turning_s)",
                "minimum_dwell_s=begins.minimum_dwell_s",
            ),
        ),
        _mutant(
            "stop taken for 400 m further on",
            "moving",
            (
                "railway/plan/world.py",
                "stop_m[row, column] = call.stop_m\n",
                "stop_m[row, column] = call.stop_m + (400.0 if column == 1 else 0.0)\n",
            ),
        ),
        _mutant(
            "falling trains meet rising gradients as they are",
            "moving",
            ("railway/plan/met.py", "gradient=-one.gradient", "gradient=one.gradient"),
        ),
        _mutant(
            "limits of falling trains not mirrored",
            "moving",
            (
                "railway/plan/met.py",
                "start_m=line.mirrored_m(one.end_m), end_m=line.mirrored_m(one.start_m)",
                "start_m=one.start_m, end_m=one.end_m",
            ),
        ),
    )
)
MUTANTS: tuple[Mutant, ...] = (
    *NETWORK,
    *(
        _mutant(f"service brake in the tables +{percent} %", "moving", (PROFILE, BRAKE, new))
        for percent, new in ((5, f"1.05 * {BRAKE}"), (20, f"1.2 * {BRAKE}"))
    ),
    *(
        _mutant(
            f"tail {ahead_m:g} m ahead of the truth",
            "moving",
            (LEADERS, f"{TAIL}\n", f"{TAIL} + {ahead_m}\n"),
        )
        for ahead_m in (1.7, 20.0, 30.0)
    ),
    _mutant(
        "margin left out",
        "moving",
        (MOVING_BLOCK, "min(rear_m, clear_to_m) - margin_m", "min(rear_m, clear_to_m)"),
    ),
    _mutant(
        "no rear buffer",
        "cbtc",
        (MOVING_BLOCK, "rear_m = leader_tail_m - float(buffer_m)", "rear_m = leader_tail_m"),
    ),
    _mutant(
        "gradient sign in protection",
        "moving",
        (PROFILE, "braked + lift", "braked - lift"),
    ),
    _mutant(
        "leader off by one at a merge",
        "moving",
        (
            TURNS,
            CHAINED,
            (
                "tuple(\n"
                "                    found[last_on[track].row].ahead[1]\n"
                "                    if number == 1 and track in last_on\n"
                "                    else last_on.get(track, NO_PREDECESSOR)\n"
                "                    for number, track in enumerate(service.route)\n"
                "                )"
            ),
        ),
    ),
    _mutant(
        "leader always row - 1",
        "moving",
        (
            TURNS,
            CHAINED,
            (
                "tuple(\n"
                "                    Predecessor(row - 1, number) if row else NO_PREDECESSOR\n"
                "                    for number, _ in enumerate(service.route)\n"
                "                )"
            ),
        ),
    ),
    _mutant(
        "limits over the front only",
        "moving",
        (PROFILE, "rear_limit_m(one.end_m, train.length_m)", "rear_limit_m(one.end_m, 0.0)"),
    ),
    _mutant(
        "points released 60 m early (leaders)",
        "moving",
        (PASSING, CLEARED, CLEARED.replace("fouling_m[1]", "fouling_m[1] - 60.0")),
    ),
    _mutant(
        "points released 60 m early (machine)",
        "moving",
        (
            POINT_MACHINE,
            "place_m = turnout.fouling_start_m, turnout.fouling_end_m",
            "place_m = turnout.fouling_start_m, turnout.fouling_end_m - 60.0",
        ),
    ),
    *(
        _mutant(
            f"circuit released by the front ({controller})",
            controller,
            (
                LOOKING,
                f"circuits.end_m[place] > trains.tail_m{TOUCHED}",
                f"circuits.end_m[place] > trains.front_m{TOUCHED}",
            ),
        )
        for controller in ("atc", "atd")
    ),
    _mutant(
        "authority 2 s old",
        "moving",
        (
            "railway/loop/stepped_run.py",
            "        self._first = True",
            "        self._first, self._given = True, []",
        ),
        (
            "railway/loop/stepped_run.py",
            "authority, self._permitted = protection.authorise(state, self._permitted)",
            (
                "authority, self._permitted = protection.authorise(state, self._permitted)\n"
                "        self._given.append(authority)\n"
                "        authority = self._given[max(len(self._given) - 1 - OLD_STEPS, 0)]"
            ),
        ),
        (
            "railway/loop/stepped_run.py",
            "REPORT_EVERY_STEPS = 1000",
            "REPORT_EVERY_STEPS, OLD_STEPS = 1000, 20",
        ),
    ),
    _mutant(
        "no turnout lock (leaders)",
        "moving",
        (LEADERS, "granted = same_way or self._at[ahead] == passage", "granted = True"),
    ),
    _mutant(
        "no turnout lock (wayside)",
        "moving",
        (
            POINT_MACHINE,
            "self.concerns[waiting[first:]] = True",
            "self.concerns[waiting[:0]] = True",
        ),
    ),
    _mutant(
        "obstructions ignored",
        "moving",
        (
            "railway/loop/tracker.py",
            "np.minimum(granted_to_m, known.obstructed_m)",
            "np.minimum(granted_to_m, np.inf)",
        ),
    ),
    _mutant(
        "points throw in 0 s",
        "moving",
        (
            POINT_MACHINE,
            "ready_s = time_s + self._turnout.throw_s + self._turnout.proof_s",
            "ready_s = time_s",
        ),
    ),
    _mutant(
        "crossing never closes",
        "moving",
        (
            LEVEL_CROSSING,
            "free = struck & scene.due(self._closed_s)",
            "free = self._users & ~passed",
        ),
    ),
    _mutant(
        "crossing closes in half the time",
        "moving",
        (
            LEVEL_CROSSING,
            "self._closed_s = time_s + self._crossing.closing_s",
            "self._closed_s = time_s + 0.5 * self._crossing.closing_s",
        ),
    ),
    _mutant(
        "fouling section 30 m later",
        "moving",
        (
            PASSING,
            "entry_m, turnout = fouling_m[0], behind",
            "entry_m, turnout = fouling_m[0] + 30.0, behind",
        ),
        (
            POINT_MACHINE,
            "place_m = turnout.fouling_start_m, turnout.fouling_end_m",
            "place_m = turnout.fouling_start_m + 30.0, turnout.fouling_end_m",
        ),
    ),
    _mutant(
        "exclusive platform shared",
        "cbtc",
        (MOVING_BLOCK, "if exclusive and not entered", "if exclusive and entered"),
    ),
    *(
        _mutant(
            f"radio validity {name}",
            "by_radio",
            (OVER_RADIO, EMERGENCY, EMERGENCY.replace("HORIZON_S", validity_s)),
        )
        for name, validity_s in (("10 s", "2.0 * HORIZON_S"), ("for ever", "math.inf"))
    ),
    _mutant(
        "reported tail + 3 s of running",
        "by_radio",
        (
            OVER_RADIO,
            "reported_m = memory.reports.front_m - self._world.length_m",
            (
                "ran_m = 3.0 * memory.reports.speed_mps\n"
                "        reported_m = memory.reports.front_m - self._world.length_m + ran_m"
            ),
        ),
    ),
    _mutant(
        "traction +10 %",
        "moving",
        (
            "railway/motion/traction_table.py",
            "gains.append(step_s * kind.level_acceleration_mps2(np.maximum(half_way, 0.0)))",
            (
                "more_mps2 = 0.1 * kind.traction.force_n(half_way) / kind.inertial_mass_kg\n"
                "        more_mps2 += kind.level_acceleration_mps2(np.maximum(half_way, 0.0))\n"
                "        gains.append(step_s * more_mps2)"
            ),
        ),
    ),
    *(
        _mutant(
            f"drive brakes {name}",
            "moving",
            (
                DRIVE,
                "next_mps[train] = max(min(wish, kept), 0.0)",
                (
                    "least = min(wish, kept)\n"
                    f"        harder = speed - {times} * (speed - least)\n"
                    "        next_mps[train] = max(min(least, harder), 0.0)"
                ),
            ),
        )
        for name, times in (("10 % too hard", 1.1), ("harder than in emergency", 1.6))
    ),
    _mutant(
        "drive forgets that the brake builds up",
        "moving",
        (STOCK, f"{EMERGENCY_BRAKE}\n", f"{EMERGENCY_BRAKE}\nbrake_build_up_s = 3.0\n"),
        (DRIVE, BUILDS_UP, BUILDS_UP.replace("rise, pulled", "np.inf, pulled")),
    ),
    _mutant(
        "ATC without idle time",
        "atc",
        (
            "controllers/protection/code_table.py",
            "return self.idle_time_s + steps * self.step_s",
            "return steps * self.step_s",
        ),
    ),
    _mutant(
        "control map 60 m beyond its bands, exclusion test off",
        "control_map",
        (
            TELEGRAMS,
            "end_m = min(stop_m + tolerance_m, plan.free_m[train])",
            "end_m = min(stop_m + tolerance_m, plan.free_m[train]) + 60.0",
        ),
        (MAP_STEPS, "if not excludes(", "if False and not excludes("),
    ),
)
