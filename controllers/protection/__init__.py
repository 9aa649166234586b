"""Protections: how far and how fast a train may go."""
