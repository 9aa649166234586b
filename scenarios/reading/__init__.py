"""
Files, strictly read: row by row and key by key.

It promises that no unknown key or column is passed over and no default stands in for a misspelt
name, and that mistakes are collected, not raised. A value that leaves this wing is in its range.
"""
