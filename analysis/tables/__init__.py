"""Tables of declared columns: what a run, a sweep, a campaign or a capacity study comes to."""
