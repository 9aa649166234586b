"""The centre of the control map: the way ahead of every train, and the run curves it plans."""
