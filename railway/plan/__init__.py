"""
What is known beforehand: line, rolling stock, timetable, and the tables made of them.

It promises:

- nothing here changes during a run; a delay or a failure is in no :class:`World`;
- lengths are in metres along the line, times in seconds after midnight, all else in SI units;
- tables of all trains lie in one array, and only the module that lays one out reads it;
- an index one beyond a train's last call is valid: its stop lies where nothing lies any more.

It relies on files having been checked: what stands in them is true here.
"""
