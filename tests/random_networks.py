"""Networks made at random: parallel tracks between points, branches, and rings that are cut."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from hypothesis import assume
from hypothesis import strategies as st

from tests.networks import CALL, DWELL, LENGTH_M, MAIN, NODE, PLATFORM, STATION, STOCK, Files

START_S = 25_200
FOULING_KM = 0.05
PLATFORM_KM = 0.11
BOTH_WAYS = ("rising", "falling")


@dataclass(frozen=True)
class Rail:
    """A track between two nodes, with a platform in the middle."""

    id: str
    section: int
    from_node: str
    to_node: str
    start_km: float
    end_km: float
    direction: str
    across: float
    station: str
    resource: str = ""

    @property
    def stop_km(self) -> float:
        """Where trains of its direction stop; rising ones, if it is used both ways."""
        middle_km = round(0.5 * (self.start_km + self.end_km), 3)
        half_km = 0.5 * PLATFORM_KM - 0.005
        return round(middle_km + (half_km if self.direction != "falling" else -half_km), 3)

    def carries(self, direction: str) -> bool:
        """Return whether trains of a direction use it."""
        return self.direction in {direction, "both"}


@dataclass
class Plan:
    """Rails by section, and trains that run over them."""

    rails: list[Rail]
    nodes: list[str]
    stations: dict[str, float]
    order: str = "timetable"
    services: list[str] = field(default_factory=list)
    routes: list[str] = field(default_factory=list)
    calls: list[str] = field(default_factory=list)

    def files(self) -> Files:
        """Return the files of the scenario."""
        places = sorted(self.stations.items(), key=lambda item: item[1])
        platforms = [
            f"{rail.station},{rail.id},{middle_km - 0.5 * PLATFORM_KM:.3f},"
            f"{middle_km + 0.5 * PLATFORM_KM:.3f},{rail.stop_km:.3f}"
            for rail in self.rails
            for middle_km in [round(0.5 * (rail.start_km + rail.end_km), 3)]
        ]
        tracks = [
            f"{r.id},{r.from_node},{r.to_node},{r.direction},{r.across:g},{r.resource}"
            for r in self.rails
        ]
        main = MAIN.replace("patience_min = 30.0", "patience_min = 120.0")
        return {
            "scenario.toml": f'{main}\n[interlocking]\norder = "{self.order}"\n',
            "rolling_stock.toml": STOCK,
            "stations.csv": STATION + "".join(f"{n},{n},{n},{km:.3f},139,35\n" for n, km in places),
            "dwell_stations.csv": DWELL + "".join(f"{name},10,10,1\n" for name in self.stations),
            "nodes.csv": NODE + "".join(f"{row}\n" for row in self.nodes),
            "tracks.csv": "id,from_node,to_node,direction,across,resource\n" + _rows(tracks),
            "platforms.csv": PLATFORM + _rows(platforms),
            "services.csv": "train,train_type,next_train,route\n" + _rows(self.services),
            "routes.csv": "route,track\n" + _rows(self.routes),
            "calls.csv": CALL + _rows(self.calls),
        }


def _rows(rows: Sequence[str]) -> str:
    return "".join(f"{row}\n" for row in rows)


def _node(name: str, km: float, kind: str, throw_s: int) -> str:
    if kind != "points":
        return f"{name},{km:.3f},{kind},{km:.3f},{km:.3f},0,0"
    ends_km = km - FOULING_KM, km + FOULING_KM
    return f"{name},{km:.3f},points,{ends_km[0]:.3f},{ends_km[1]:.3f},{throw_s},1"


@st.composite
def random_plans(draw: st.DrawFn) -> Plan:
    """Draw a network without trains: a row of sections, with branches, or a ring."""
    ring = draw(st.integers(0, 4)) == 0
    lengths_km = draw(st.lists(st.sampled_from([0.5, 0.7, 1.1]), min_size=2, max_size=4))
    if ring:
        lengths_km = [0.5, *lengths_km, 0.5]
    ends_km = [0.0]
    for length_km in lengths_km:
        ends_km.append(round(ends_km[-1] + length_km, 3))
    throw_s = draw(st.sampled_from([0, 3]))
    last = len(lengths_km)
    kinds = ["buffer", *["points"] * (last - 1), "buffer"]
    nodes = [
        _node(f"n{n}", km, kind, throw_s)
        for n, (km, kind) in enumerate(zip(ends_km, kinds, strict=True))
    ]
    plan = Plan([], nodes, {})
    for section in range(last):
        cut = ring and section in {0, last - 1}
        ways = list(BOTH_WAYS) if cut else draw(_parallel)
        ends = ends_km[section], ends_km[section + 1]
        station = f"s{section}"
        plan.stations[station] = 0.5 * sum(ends)
        plan.rails += [
            Rail(
                f"t{section}-{number}",
                section,
                f"n{section}",
                f"n{section + 1}",
                *ends,
                direction,
                float(number),
                station,
                f"cut-{number}" if cut else "",
            )
            for number, direction in enumerate(ways)
        ]
    for side in () if ring else draw(st.lists(st.sampled_from("xy"), max_size=2, unique=True)):
        _branch(plan, side, draw(st.integers(1, last - 1)), ends_km, draw(_way))
    return plan


_way = st.sampled_from(["both", "both", *BOTH_WAYS])
_parallel = st.one_of(
    st.just(["both"]),
    st.just(["both", "both"]),
    st.just(list(BOTH_WAYS)),
    st.lists(_way, min_size=1, max_size=3),
)


def _branch(plan: Plan, side: str, node: int, ends_km: Sequence[float], direction: str) -> None:
    """Add a branch that joins a row of sections from below (x) or parts from it upwards (y)."""
    joins_km, end = ends_km[node], f"{side}-end"
    low = side == "x"
    end_km = round(joins_km - 0.62 if low else joins_km + 0.62, 3)
    plan.nodes.append(_node(end, end_km, "buffer", 0))
    ends = (end, f"n{node}", end_km, joins_km) if low else (f"n{node}", end, joins_km, end_km)
    plan.stations[side] = 0.5 * (joins_km + end_km)
    # Beside whatever lies there; as a neighbour section of the points it is one like others.
    plan.rails.append(Rail(side, node - 1 if low else node, *ends, direction, 9.0, side))


@st.composite
def random_networks(draw: st.DrawFn) -> Files:
    """Draw a network with trains at random times on random ways; some go on as others."""
    plan = draw(random_plans())
    plan.order = draw(st.sampled_from(["timetable", "timetable", "first_come"]))
    number = 0
    for _ in range(draw(st.integers(1, 4))):
        ready_s, origin, direction = START_S + draw(st.integers(0, 600)), None, draw(_direction)
        for lap in range(draw(st.integers(1, 3))):
            way = _way_over(draw, plan, direction, origin)
            if not way:
                break
            if lap:
                plan.services[-1] = plan.services[-1].replace(",unit,,", f",unit,q{number},")
            ready_s = _run(draw, plan, f"q{number}", direction, way, ready_s)
            number += 1
            last = way[-1]
            twins = [r for r in plan.rails if last.resource and r.resource == last.resource]
            twin = next((r for r in twins if r is not last), None)
            origin = twin or last
            if twin is None:
                direction = BOTH_WAYS[direction == "rising"]
    assume(plan.services)
    return plan.files()


_direction = st.sampled_from(BOTH_WAYS)


def _way_over(draw: st.DrawFn, plan: Plan, direction: str, origin: Rail | None) -> list[Rail]:
    """Return rails one behind the other, as far as they lead; none where none does."""
    starts = [r for r in plan.rails if r.carries(direction)] if origin is None else [origin]
    starts = [rail for rail in starts if rail.carries(direction)]
    if not starts:
        return []
    way = [draw(st.sampled_from(starts))]
    for _ in range(draw(st.integers(0, 4))):
        here = way[-1]
        node = here.to_node if direction == "rising" else here.from_node
        onward = [
            rail
            for rail in plan.rails
            if rail.carries(direction)
            and (rail.from_node if direction == "rising" else rail.to_node) == node
        ]
        if not onward:
            break
        way.append(draw(st.sampled_from(onward)))
    return way


def _run(
    draw: st.DrawFn, plan: Plan, train: str, direction: str, way: Sequence[Rail], ready_s: int
) -> int:
    """Add a train to the timetable and return when it has ended. [s]"""
    plan.services.append(f"{train},unit,,{train}-way")
    plan.routes += [f"{train}-way,{rail.id}" for rail in way]
    time_s = ready_s
    for number, rail in enumerate(way):
        ends = number in {0, len(way) - 1}
        if not ends and not draw(st.booleans()):
            time_s += 60
            continue
        arrival_s = time_s
        time_s += draw(st.sampled_from([10, 20, 70, 200])) + (60 if number == 0 else 0)
        clocks = (f"{t // 3600:02d}:{t // 60 % 60:02d}:{t % 60:02d}" for t in (arrival_s, time_s))
        plan.calls.append(f"{train},{rail.station},{rail.id},{','.join(clocks)}")
        if number + 1 < len(way):
            time_s += draw(st.sampled_from([60, 90, 150]))
    assert direction in BOTH_WAYS
    assert rail.end_km - rail.start_km > LENGTH_M / 1000.0
    return time_s
