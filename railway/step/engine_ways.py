"""How SUMO takes part in a run; imports nothing."""

EVERY_STEP = "every_step"
"""SUMO moves the trains and keeps their stops, and is told in every step."""
WITNESS = "witness"
"""Trains are moved and stops are kept here; SUMO looks at places and collisions once a second."""
ENGINES = (EVERY_STEP, WITNESS)
