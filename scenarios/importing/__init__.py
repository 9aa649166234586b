"""
Other people's files to drafted scenarios, one module for each format.

It promises that a source is read or refused with file, row and reason, never with a traceback, and
that every figure that the source does not have stands in ``SOURCES.md``.
"""
