"""
What crosses rooms in every step: states, permissions, advice, commands, records.

It promises:

- rows are trains, in timetable order, and stay so for a whole run;
- whoever is shown a state may keep it: its arrays are never written to afterwards;
- what changes with events only has a version, which is another one when it has changed;
- every field of :class:`~kankaku.railway.step.state.Authority` and
  :class:`~kankaku.railway.step.state.Advice` is filled.

It relies on nothing but the plan. An end of authority is a place; a limit is a speed.
"""
