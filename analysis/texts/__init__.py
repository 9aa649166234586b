"""
Tables in words: reports in Markdown and lines for a terminal.

It promises that nothing is told that is not in a table, and that a change is told in per cent only
where the baseline is large enough for that.
"""
