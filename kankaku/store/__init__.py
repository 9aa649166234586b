"""
The results folder: finished runs, what they were made from, and who writes there.

It promises that a finished run survives any kill, that one command at a time writes to a folder,
and that runs of other files, options, versions or sources are never mixed with new ones.
"""
