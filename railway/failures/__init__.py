"""
What goes wrong: units, equipment at random, and what that does to availability.

It promises:

- the same seed fails the same things at the same times under every controller;
- a failure changes what is measured, said or granted, never the rules that judge a run.

It relies on failures being added from outside: a run without them knows nothing of this wing.
"""
