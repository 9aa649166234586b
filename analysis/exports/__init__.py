"""
Results in the formats of other programs: railsim, SUMO, GTFS and tidy Parquet.

It promises files that those programs read, and nothing that the results do not hold. It relies on
the tables of saved runs alone; what only the scenario knows, it is told.
"""
