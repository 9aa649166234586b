"""
What is beside the track and what it knows: detection, points, level crossings, closures.

It promises:

- points do not move under a train, nor under a permission that may still be used;
- what is granted to a train stays so until it has passed, but for what comes suddenly;
- a train is detected where it is, and for the release delay after its tail has left.

It relies on fronts and tails as the engine moves them, not on what trains say of themselves.
"""
