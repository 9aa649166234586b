"""Faults put into a copy of the source on purpose: is each of them seen in a run?"""
