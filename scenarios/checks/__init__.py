"""
Whether the files of a scenario agree with each other, and whether trains can run on them.

It relies on rows and keys that are right each for itself, and promises that what is left over
fits: stations on tracks, calls on platforms, routes on the line, trains that can climb it.
"""
