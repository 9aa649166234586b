"""
How dense a timetable can be: blocking times, headways, compression.

It promises:

- a headway is that of two trains that do not hinder each other;
- it asks a protection beforehand and simulates nothing.

It relies on :class:`~kankaku.railway.step.control.Foresight`: what a protection says beforehand is
what it permits.
"""
