"""What a controller says when an option has a value it cannot use."""


class OptionError(ValueError):
    """An option with a value that is not allowed: what is wrong and what is allowed."""

    def __init__(self, problem: str, allowed: str) -> None:
        super().__init__(f"{problem}; allowed: {allowed}")
        self.problem = problem
        self.allowed = allowed
