"""
One train alone: how it speeds up, brakes, coasts and climbs.

It promises:

- every run keeps the line ceiling and what traction and brakes can do, gravity included;
- a table says of itself how finely it is cut, and only its own module reads it;
- what cannot be run is told by an error of its own, not by a run that is nearly right.

It relies on the tables of the plan, and knows no other train, no signal and no delay.
"""
