"""
The only loop: observe, protect, operate, drive, record, apply, advance.

It promises:

- each phase comes once in every step, in this order, for every controller;
- the monitor of safety is always there, and what it has found is told even if a run breaks off;
- in the first step it is checked that every layer tells all that it has agreed to tell, and
  writes to nothing that it is only shown.

It relies on an engine that does as it is told; the engine's own checks tell when it does not.
"""
