"""Radio traffic as discrete events; the only room that knows simpy."""

from kankaku.telecom.radio_traffic import simulate

__all__ = ["simulate"]
