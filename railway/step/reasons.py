"""Why trains are as fast as they are: in one vocabulary, whatever controls them."""

import numpy as np

from kankaku.railway.arrays import BoolArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.errors import KankakuError
from kankaku.railway.step.control import Bound, Command, Controller
from kankaku.railway.step.state import (
    NO_REASON,
    NOTHING,
    Advice,
    Authority,
    LineState,
    Reason,
    beside,
)

# Plain numbers, as compiled functions want them.
CEILING, ADVICE, LIMIT = int(Bound.CEILING), int(Bound.ADVICE), int(Bound.LIMIT)
LINE_LIMIT, PLAN, DWELLING = int(Reason.LINE_LIMIT), int(Reason.PLAN), int(Reason.DWELLING)
TRAIN_AHEAD, OBSTRUCTION_AHEAD = int(Reason.TRAIN_AHEAD), int(Reason.OBSTRUCTION_AHEAD)


def _reasons_by_bound() -> IntArray:
    """Return the reason of each bound that needs no second look."""
    reasons = np.full(len(Bound), Reason.TRACTION, dtype=np.intp)
    reasons[Bound.STOP] = Reason.STATION_STOP
    reasons[Bound.EMERGENCY] = Reason.EMERGENCY
    reasons[Bound.PEER] = Reason.PEER
    reasons[Bound.HELD] = Reason.HELD
    return reasons


REASON_OF_BOUND = _reasons_by_bound()
# As a compiled loop takes it, which would be another kind of array otherwise.
REASON_OF_BOUND.setflags(write=False)


class ReasonError(KankakuError):
    """A layer that does not say why it lowers a speed, or names what is not there."""


class Reasons:
    """
    Finds the reason, the operation's own word and the cause of every train's speed.

    Parameters
    ----------
    controller
        The layers.
    size
        Number of trains. [-]
    places
        Number of places beside the track. [-]

    Raises
    ------
    ReasonError
        If the operation declares no words, or words that are no plain identifiers.
    """

    def __init__(self, controller: Controller, size: int, places: int = 0) -> None:
        kind = type(controller.operation).__name__
        self._operation = f"operation {kind} of controller {controller.name}"
        self.words = self._declared(getattr(controller.operation, "reasons", None))
        """The operation's own words."""
        self._controller = controller.name
        self._causes = beside(places - 1), size - 1
        self._nothing = np.full(size, NOTHING, dtype=np.intp)
        self._never_bound = np.full(size, Bound.TRACTION, dtype=np.intp)
        self._checked: IntArray = np.zeros(0, dtype=np.intp)

    def _declared(self, words: object) -> tuple[str, ...]:
        if not isinstance(words, tuple) or not all(isinstance(word, str) for word in words):
            msg = f"{self._operation} declares no reasons: a tuple of words, which may be empty"
            raise ReasonError(msg)
        for word in words:
            if not (word.isascii() and word.isidentifier()):
                msg = f"{self._operation} declares the reason {word!r}, which is no plain word"
                raise ReasonError(msg)
        if len(set(words)) < len(words):
            msg = f"{self._operation} declares a reason twice: {', '.join(words)}"
            raise ReasonError(msg)
        return words

    def check(self, advice: Advice) -> None:
        """
        Refuse advice for a reason that is not declared; called in every step.

        Parameters
        ----------
        advice
            What operation asks for.

        Raises
        ------
        ReasonError
            If a number stands for no word of the operation.
        """
        reason = advice.reason
        # Many an operation gives the same array as long as nothing changes.
        if reason is not self._checked:
            self._check(reason, self._never_bound)
            self._checked = reason

    def _check(self, reason: IntArray, bound: IntArray) -> None:
        if reason.shape != self._nothing.shape or reason.dtype.kind != "i":
            msg = f"{self._operation} gives its reasons as no whole number for each train"
            raise ReasonError(msg)
        row = _unexplained(reason, bound, len(self.words))
        if row >= 0:
            known = ", ".join(f"{number} {word}" for number, word in enumerate(self.words))
            msg = (
                f"{self._operation} gives reason {reason[row]} for the train in row {row}; "
                f"declared: {known or 'none'}"
            )
            raise ReasonError(msg)

    def of(
        self, state: LineState, authority: Authority, advice: Advice, command: Command
    ) -> IntArray:
        """
        Return why every train is as fast as it is.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        advice
            What operation asks for.
        command
            What the drive makes of it.

        Returns
        -------
        IntArray
            A :class:`~kankaku.railway.step.state.Reason`, the number of the operation's word under
            ``Reason.PLAN``, else ``NO_REASON``, and what is behind it: a train, a place or
            ``NOTHING``. shape (3, n_trains)

        Raises
        ------
        ReasonError
            If a speed is lowered for no reason, or what is named is neither a train nor a place
            beside the track.
        """
        self._check(advice.reason, command.bound)
        found: IntArray = nothing_found(1, state.running.size)[0]
        behind = authority.eoa_by, authority.ceiling_by
        why = command.bound, behind, (advice.reason, advice.cause)
        rows = np.flatnonzero(state.present)
        explain(state.running, rows, why, REASON_OF_BOUND, found)
        self._check_causes(found[2])
        return found

    def check_sampled(self, found: IntArray, asked: IntArray) -> None:
        """
        Refuse what :meth:`of` refuses, for samples that were taken without it.

        Parameters
        ----------
        found
            What :func:`explain` found. shape (n_samples, 3, n_trains)
        asked
            Reason of the advice and bound of the command. shape (n_samples, 2, n_trains)

        Raises
        ------
        ReasonError
            As :meth:`of`.
        """
        sample = _first_unexplained(asked, len(self.words))
        if sample >= 0:
            self._check(asked[sample, 0], asked[sample, 1])
        self._check_causes(found[:, 2])

    def _check_causes(self, cause: IntArray) -> None:
        least, most = self._causes
        if cause.min() < least or cause.max() > most:
            msg = f"controller {self._controller} names causes that are no train and no place"
            raise ReasonError(msg)


@formula
def _unexplained(reason: IntArray, bound: IntArray, words: int) -> int:
    """Return the first train whose advice has no word although it needs one; -1 for none."""
    for train in range(reason.size):
        least = 0 if bound[train] == ADVICE else NO_REASON
        if not least <= reason[train] < words:
            return train
    return -1


@formula
def _first_unexplained(asked: IntArray, words: int) -> int:
    """Return the first sample with an advice that needs a word and has none; -1 for none."""
    for sample in range(asked.shape[0]):
        for train in range(asked.shape[2]):
            least = 0 if asked[sample, 1, train] == ADVICE else NO_REASON
            if not least <= asked[sample, 0, train] < words:
                return sample
    return -1


def nothing_found(samples: int, size: int) -> IntArray:
    """
    Return what :func:`explain` writes to.

    Parameters
    ----------
    samples
        How many samples. [-]
    size
        How many trains. [-]

    Returns
    -------
    IntArray
        All trains dwell. shape (n_samples, 3, n_trains)
    """
    found = np.full((samples, 3, size), NOTHING, dtype=np.intp)
    found[:, 0] = DWELLING
    return found


@formula
def explain(
    running: BoolArray,
    rows: IntArray,
    why: tuple[IntArray, tuple[IntArray, IntArray], tuple[IntArray, IntArray]],
    reason_of_bound: IntArray,
    found: IntArray,
) -> None:
    """
    Tell why every train is as fast as it is.

    Parameters
    ----------
    running
        Trains that take commands. shape (n_trains,)
    rows
        Trains on the line. shape (n_present,)
    why
        What counts for the drive; what ends each way, and what makes each ceiling low; reason and
        cause of the advice. shape (n_trains,) each
    reason_of_bound
        The reason of each bound that needs no second look. shape (n_bounds,)
    found
        As :meth:`Reasons.of`; written to, as :func:`nothing_found` made it. shape (3, n_trains)
    """
    bound, (eoa_by, ceiling_by), (advised, advised_for) = why
    for train in rows:
        if not running[train]:
            continue
        found[0, train] = reason_of_bound[bound[train]]
        if bound[train] == ADVICE:
            found[0, train], found[1, train] = PLAN, advised[train]
            found[2, train] = advised_for[train]
        elif bound[train] == CEILING or bound[train] == LIMIT:
            by = ceiling_by[train] if bound[train] == CEILING else eoa_by[train]
            found[2, train] = by
            if by == NOTHING:
                found[0, train] = LINE_LIMIT
            else:
                found[0, train] = TRAIN_AHEAD if by > NOTHING else OBSTRUCTION_AHEAD
