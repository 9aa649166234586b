"""A small infrastructure in RailJSON, with a train and train schedules."""

from typing import Any


def section(name: str, length_m: float, **more: object) -> dict[str, Any]:
    return {"id": name, "length": length_m, "slopes": [], "curves": [], **more}


def point(name: str, *parts: tuple[str, float], uic: int) -> dict[str, Any]:
    return {
        "id": name,
        "parts": [{"track": track, "position": at_m} for track, at_m in parts],
        "extensions": {"identifier": {"name": name.title(), "uic": uic}},
    }


def end(track: str, endpoint: str) -> dict[str, str]:
    return {"track": track, "endpoint": endpoint}


# West - loop or straight - East; the eastern track is laid from its end to its beginning.
INFRA: dict[str, Any] = {
    "version": "3.4.13",
    "operational_points": [
        point("west", ("w", 400.0), uic=1),
        point("mid", ("straight", 500.0), ("loop", 520.0), uic=2),
        point("east", ("e", 300.0), uic=3),
    ],
    "routes": [],
    "extended_switch_types": [],
    "switches": [
        {
            "id": "s1",
            "switch_type": "point_switch",
            "ports": {
                "A": end("w", "END"),
                "B1": end("straight", "BEGIN"),
                "B2": end("loop", "BEGIN"),
            },
        },
        {
            "id": "s2",
            "switch_type": "point_switch",
            "ports": {"A": end("e", "END"), "B1": end("straight", "END"), "B2": end("loop", "END")},
        },
    ],
    "track_sections": [
        section("w", 2000.0, slopes=[{"gradient": 5.0, "begin": 1000.0, "end": 2000.0}]),
        section("straight", 1000.0, curves=[{"radius": -800.0, "begin": 100.0, "end": 300.0}]),
        section("loop", 1010.0),
        section("e", 3000.0, slopes=[{"gradient": 8.0, "begin": 500.0, "end": 1500.0}]),
    ],
    "speed_sections": [
        {
            "speed_limit": 20.0,
            "speed_limit_by_tag": {"FREIGHT": 10.0},
            "track_ranges": [
                {"track": "w", "begin": 500.0, "end": 2000.0, "applicable_directions": "BOTH"},
                {
                    "track": "e",
                    "begin": 0.0,
                    "end": 700.0,
                    "applicable_directions": "STOP_TO_START",
                },
                {
                    "track": "e",
                    "begin": 0.0,
                    "end": 900.0,
                    "applicable_directions": "START_TO_STOP",
                },
            ],
        },
        {
            "speed_limit": 15.0,
            "track_ranges": [
                {"track": "w", "begin": 1500.0, "end": 2000.0, "applicable_directions": "BOTH"}
            ],
        },
    ],
    "electrifications": [],
    "signals": [
        {"id": "up1", "track": "w", "position": 1000.0, "direction": "START_TO_STOP"},
        {"id": "up2", "track": "e", "position": 2500.0, "direction": "STOP_TO_START"},
        {"id": "down", "track": "e", "position": 1000.0, "direction": "START_TO_STOP"},
    ],
    "detectors": [{"id": "d", "track": "w", "position": 700.0}],
    "buffer_stops": [{"id": "b", "track": "w", "position": 0.0}],
}
STOCK: dict[str, Any] = {
    "railjson_version": "3.2",
    "name": "unit",
    "length": 100.0,
    "mass": 200000.0,
    "max_speed": 30.0,
    "startup_acceleration": 0.05,
    "inertia_coefficient": 1.06,
    "gamma": {"type": "CONST", "value": 0.7},
    "rolling_resistance": {"type": "davis", "A": 3000.0, "B": 100.0, "C": 6.0},
    "effort_curves": {
        "default_mode": "25000V",
        "modes": {
            "25000V": {
                "curves": [{"cond": {"comfort": "HEATING"}, "curve": {}}],
                "default_curve": {"speeds": [0, 10, 25], "max_efforts": [180000, 180000, 90000]},
            },
            "thermal": {"curves": [], "default_curve": {"speeds": [0], "max_efforts": [1]}},
        },
    },
}
SCHEDULES: list[dict[str, Any]] = [
    {
        "train_name": "Fast",
        "start_time": "2026-03-01T06:10:00Z",
        "path": [{"id": "a", "uic": 1}, {"id": "b", "operational_point": "east"}],
        "schedule": [],
    },
    {
        "train_name": "Slow",
        "start_time": "2026-03-01T06:00:00+00:00",
        "path": [
            {"id": "a", "uic": 1},
            {"id": "x", "track": "straight", "offset": 100},
            {"id": "m", "operational_point": "mid"},
            {"id": "b", "uic": 3},
        ],
        "schedule": [{"at": "m", "arrival": "PT8M", "stop_for": "PT1M30S"}],
    },
    {
        "train_name": "Back",
        "start_time": "2026-03-01T06:00:00Z",
        "path": [{"id": "a", "uic": 3}, {"id": "b", "uic": 1}],
    },
]
