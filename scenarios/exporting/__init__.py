"""
Scenarios in other people's formats: what a planner takes on to another program.

It promises that nothing is told that the scenario does not have, and that what a format cannot
hold is named.
"""
