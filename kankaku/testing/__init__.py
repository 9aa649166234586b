"""
Checks that any protection or operation has to pass, whoever wrote it.

``kankaku check-controller NAME`` runs them; in a test of an own package:

>>> from kankaku.testing import check_controller, failures
>>> assert not failures(check_controller("moving_block+close_up"))

They promise that a controller which passes can be compared with others: it answers from what it
is told and what it remembers alone, it leaves the state as it is, it says why, it never lets a
train come too near another one, and what it says beforehand is what it permits.
"""

from kankaku.testing.contract import CHECKS, Finding, check_candidate, check_controller, failures

__all__ = ["CHECKS", "Finding", "check_candidate", "check_controller", "failures"]
