"""Kankaku: which way of train control keeps a delay from spreading, on any line."""
