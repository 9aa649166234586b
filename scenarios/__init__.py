"""Scenario folders: strict file formats and their reader."""

from scenarios.dependability import load_configurations, load_fault_tree
from scenarios.faults import Fault, ScenarioError
from scenarios.load import load
from scenarios.radio_network import load_radio_plan
from scenarios.texts import printable

__all__ = [
    "Fault",
    "ScenarioError",
    "load",
    "load_configurations",
    "load_fault_tree",
    "load_radio_plan",
    "printable",
]
