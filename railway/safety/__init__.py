"""
Who trusts nobody: everything that judges whether a run was safe.

It promises:

- it shares no code with protection, wayside or motion, and reads the line itself;
- it looks at every step of every train, and reports what it finds, however the run goes on;
- a tolerance covers what comes of discrete steps, and nothing else.

It relies on places and speeds from the engine, and on a protection's promises as bare figures.
"""
