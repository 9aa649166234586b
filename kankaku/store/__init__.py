"""The results folder: finished runs, what they were made from, and who writes there."""
