"""Scenario folders: strict file formats and their reader."""

from kankaku.scenarios.dependability import load_configurations, load_fault_tree
from kankaku.scenarios.faults import Fault, ScenarioError
from kankaku.scenarios.load import load
from kankaku.scenarios.radio_network import load_radio_plan
from kankaku.scenarios.texts import printable

__all__ = [
    "Fault",
    "ScenarioError",
    "load",
    "load_configurations",
    "load_fault_tree",
    "load_radio_plan",
    "printable",
]
