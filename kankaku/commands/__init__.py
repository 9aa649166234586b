"""What a user meets in a terminal: the command line, and what it shows."""
