"""
Checked files to a scenario: the one place where field units become SI.

It relies on files without mistakes, and promises the same scenario for the same bytes.
"""
