"""The door to Eclipse SUMO: its files, its network and its engine."""
