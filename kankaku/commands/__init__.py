"""
What a user meets in a terminal: the command line, and what it shows.

It promises an answer on one screen to any wrong input (exit status 2), the sentence of each failed
run (1), every violation (3), and an end at any interrupt that keeps what is finished (130).
"""
