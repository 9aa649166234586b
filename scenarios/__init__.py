"""Scenario folders: strict file formats, their reader and their checks, beside the data."""
