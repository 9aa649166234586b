"""What the command ``check-controller`` shows: each check, and what is wrong."""

from rich.markup import escape
from rich.table import Table

from kankaku.commands.screen import EXIT_FAILED, answers, complain
from kankaku.railway.errors import KankakuError
from kankaku.testing import check_controller, failures


def judge(name: str) -> int:
    """
    Check a controller and tell what came of it.

    Parameters
    ----------
    name
        A protection, an operation, a supervision, or several of them.

    Returns
    -------
    int
        How the command ends.
    """
    try:
        findings = check_controller(name)
    except KankakuError as error:
        complain(f"{name} cannot be checked", error.sentences)
    table = Table("check", "result")
    for found in findings:
        table.add_row(found.check, escape(found.problem) or "passed")
    answers.print(table)
    wrong = len(failures(findings))
    told = f"{wrong} of {len(findings)} checks failed" if wrong else "It keeps the contract."
    answers.print(f"{name}: {told}" if wrong else told)
    return EXIT_FAILED if wrong else 0
