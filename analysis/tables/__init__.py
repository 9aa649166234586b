"""
Tables of declared columns: what a run, a sweep, a campaign or a capacity study comes to.

It promises that a frame has the declared columns in the declared order and types, whatever is
in it, and that an indicator is declared once (:mod:`kankaku.analysis.tables.indicators`). Rows are
ordered by what they are about, never by who was ready first.
"""
