"""Where the rooms meet: a run, a study of many, capacity, campaigns, radio and availability."""
