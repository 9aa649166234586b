"""
Where the rooms meet: a run, a study of many, capacity, campaigns, radio and availability.

It promises that a run is a function of scenario, controller, seed and step, that one failed run is
one run that failed, and that what is finished stays. It is the only place that imports rooms that
do not know each other.
"""
