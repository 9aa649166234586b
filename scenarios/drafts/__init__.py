"""
Scenarios before they are written: from stations and trips to a folder of plain files.

A *sketch* is what a planner knows: stations, trips, a train, perhaps limits and gradients.
``layout`` lays tracks, platforms and points for it, ``equipment`` adds blocks and controllers,
and ``tables`` holds the rows of all files and writes them.
It promises that nothing is assumed in silence: whatever was not given is told in ``SOURCES.md``.
"""
