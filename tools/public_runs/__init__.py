"""What the public minutes say about runs and dwells by time of day."""
