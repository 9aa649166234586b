"""The one base class of errors that a user can mend, and how any error is told in a line."""


class KankakuError(ValueError):
    """
    What whoever uses the program can mend: where it is, what is wrong, and what is allowed.

    Every such error of every room is one of these, and one place tells them all.
    """

    verdict = "cannot be run"
    """What that means for the scenario that is used."""

    def __init__(self, where: str, problem: str = "", allowed: str = "") -> None:
        told = f"{where}: {problem}" if where and problem else where or problem
        super().__init__(f"{told}; allowed: {allowed}" if allowed else told)
        self.where = where
        self.problem = problem
        self.allowed = allowed

    @property
    def sentences(self) -> tuple[str, ...]:
        """Everything that is wrong, a sentence each."""
        return (str(self),)


def sentence_of(error: BaseException) -> str:
    """
    Return an error in one line.

    Parameters
    ----------
    error
        Any error.

    Returns
    -------
    str
        Its kind and what it says.
    """
    told = " ".join(str(error).split())
    return f"{type(error).__name__}: {told}" if told else type(error).__name__
