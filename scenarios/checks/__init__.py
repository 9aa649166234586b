"""Whether the files of a scenario agree with each other, and trains can run on them."""
