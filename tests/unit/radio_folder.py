"""The small scenario with a radio network, devices that fail and a fault tree."""

from pathlib import Path

from tests.unit.scenario_folder import write_scenario

RADIO_FILES = {
    "radio_network.toml": """\
schema_version = 1
cells = 2
overlap_m = 300.0
late_s = 2.0

[systems.central]
title = "central controller"
central = true
wired_kbps = 10000
radio_kbps = 64
radio_packet_bytes = 180
wired_packet_bytes = 7740
cycle_s = 1.0
updates_per_cycle = 2
broadcasts_per_update = 2
own_slots_per_cycle = 1
answer_slots = 6
trackside_devices = 30
trackside_devices_max = 30
loss_percent = 0.0
repeats = 1

[systems.base_units]
title = "base units"
central = false
wired_kbps = 10000
radio_kbps = 2.4
radio_packet_bytes = 72
wired_packet_bytes = 72
cycle_s = 1.0
updates_per_cycle = 1
broadcasts_per_update = 0
own_slots_per_cycle = 0
answer_slots = 1
trackside_devices = 0
trackside_devices_max = 0
loss_percent = 0.0
repeats = 0

[published]
source = "A table, 2020"

[[published.loads]]
system = "central"
trains = 1
antenna_train_percent = 80.0
round_trip_mean_s = 0.9
""",
    "availability.toml": """\
schema_version = 1
source = "A table, 2020"

[devices.controller]
failures_per_hour = 1e-4
repair_h = 2.0

[devices.base_unit]
failures_per_hour = 2e-4
repair_h = 4.0

[systems.plain]
title = "plain"

[systems.plain.devices]
controller = { count = 1, effect = 1 }
base_unit = { count = 3, effect = "1/3" }

[systems.plain.published]
failures_per_year = 6.13
""",
    "fault_tree.toml": """\
schema_version = 1
period_h = 1.0
tops = ["collision"]

[events]
wrong = { title = "map is wrong", probability = 1e-5 }
missed = { title = "check misses it", probability = 1e-3 }
blind = { title = "check is off", probability = 1e-4 }

[gates.collision]
title = "Collision"
all_of = ["wrong", "unnoticed"]

[gates.unnoticed]
title = "unnoticed"
any_of = ["missed", "blind"]
""",
}


def write_radio_scenario(folder: Path) -> Path:
    """Write the scenario and return its folder."""
    write_scenario(folder)
    for name, text in RADIO_FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder
