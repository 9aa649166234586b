"""
Scenario folders: strict file formats, their reader and their checks, beside the data.

It promises that a folder which is read can be run, that all mistakes of a folder are told at once
(file, row or key, what is wrong, what is allowed), and that field units end here: whatever leaves
this room is in SI units.
"""
