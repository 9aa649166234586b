"""Errors in words."""


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
