"""
A centre and its trains, which hear of each other by radio only.

It promises:

- a permission that was sent once stays safe, whatever is lost or late after it;
- a train whose commands have run out brakes in emergency until it stands and has commands again.

It relies on the wire for points and obstructions, and on reports for trains.
"""
