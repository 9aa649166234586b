"""
The door to Eclipse SUMO: its files, its network and its engine.

It promises that only ``engine`` and ``native`` talk to a running SUMO, that a network is built
once per content, and that an engine which does not place trains where they were commanded to
ends the run. It relies on commands that are possible.
"""
