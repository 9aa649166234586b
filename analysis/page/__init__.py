"""
The page of a study: tables to data, data to one HTML file that needs nothing else.

It is made from saved tables alone, so that whoever has a results folder can make it again. The
browser's part lies in ``browser/``.
"""
