"""
From the record of a run to tables, sentences, figures and a folder of results.

It promises that the same record gives the same bytes, and that every column is declared once, with
unit and meaning. It relies on nothing but the vocabulary of :mod:`kankaku.railway`: it knows no
controller, no file format of scenarios and no SUMO.

``publish`` writes what ``figures`` draws and ``texts`` tells of ``tables``; ``words`` says how
names and times are told. An import goes down this order only.
"""
