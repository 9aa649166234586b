"""Scenario folders: strict file formats and their reader."""

from scenarios.faults import Fault, ScenarioError
from scenarios.load import load

__all__ = ["Fault", "ScenarioError", "load"]
