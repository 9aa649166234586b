"""An engine of a few lines, for tests that need no SUMO."""

from kankaku.railway.loop.plain_engine import PlainEngine


class ToyEngine(PlainEngine):
    """Moves trains exactly as commanded; an ``Engine`` of the contract."""
