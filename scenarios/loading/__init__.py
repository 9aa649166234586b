"""Checked files to a scenario: the one place where field units become SI."""
