"""Files, strictly read, row by row and key by key; mistakes are collected, not raised."""
