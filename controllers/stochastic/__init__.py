"""
PlatformWay to a platform whose release is uncertain, by stochastic dynamic programming.

``approach_site`` lays out what protection and line permit behind a leader that stands and then
departs; ``run_in`` runs the follower on after the release; ``belief`` says how likely the release
is; ``waiting`` plans for the time before; ``site_tables`` keeps what was worked out; ``choice``
looks it up for every train; ``merging`` keeps trains at platforms before points;
``stochastic_approach`` is the operation, ``approach_options`` are its options.
"""
