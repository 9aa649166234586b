"""
Run and read
============

x
"""

print(1)
