"""
What was observed on a real line: when trains stood where, and what their dwells are like.

It promises that faults of observations are counted and told, and that the files it makes are those
that a scenario draws its dwell delays from.
"""
