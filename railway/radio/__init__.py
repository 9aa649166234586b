"""
The radio between a centre and its trains: what arrives, and when.

It promises:

- messages go by the numbers of their cycles; times are worked out from these;
- what one train loses depends neither on other trains nor on the controller;
- nothing is known before it has arrived.

It relies on being asked once in every step, in the order of time.
"""
