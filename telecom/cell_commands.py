"""Commands on their way, and which of them each cell has to send."""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.radio.cells import Cells, RadioSystem


@dataclass(slots=True)
class RadioCommand:
    """A telegram to one device on its way."""

    made_s: float
    cell: int
    device: int
    """Row of a train; trackside devices count down from -1."""
    arrived_s: float = np.nan
    """When it was received whole; not a number if never. [s]"""
    returned_s: float = np.nan
    """When its answer was back where it was made; not a number if never. [s]"""
    tries: int = 0


class Presence:
    """Which devices each cell has to reach in each update."""

    def __init__(self, system: RadioSystem, cells: Cells, front_m: FloatArray) -> None:
        self.system = system
        serving = cells.serving(front_m)
        update, train, cell = np.nonzero(serving)
        self._trains: dict[tuple[int, int], list[int]] = {}
        for number, row, place in zip(update.tolist(), train.tolist(), cell.tolist(), strict=True):
            self._trains.setdefault((number, place), []).append(row)

    def commands(self, update: int, cell: int, made_s: float) -> list[RadioCommand]:
        """
        Return the commands of one cell in one update.

        Parameters
        ----------
        update
            Number of the update.
        cell
            Number of the cell.
        made_s
            When they are made. [s]

        Returns
        -------
        list[RadioCommand]
            To its trains, and to the trackside devices whose turn it is.
        """
        every = self.system.updates_per_cycle
        devices = [
            *self._trains.get((update, cell), ()),
            *(
                -1 - number
                for number in range(self.system.trackside_devices)
                if (number + update) % every == 0
            ),
        ]
        return [RadioCommand(made_s, cell, device) for device in devices]

    def shared(self, update: int, cell: int) -> list[int]:
        """
        Return the neighbours that serve a train of this cell, too.

        Parameters
        ----------
        update
            Number of the update.
        cell
            Number of the cell.

        Returns
        -------
        list[int]
            Cells, one entry per train.
        """
        own = set(self._trains.get((update, cell), ()))
        return [
            other
            for other in (cell - 1, cell + 1)
            for _ in own.intersection(self._trains.get((update, other), ()))
        ]
