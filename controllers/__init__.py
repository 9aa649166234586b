"""Controllers: a protection says how far and how fast, an operation how to use it, a drive goes."""
