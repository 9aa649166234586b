"""What is counted and drawn of lost telegrams."""

import numpy as np
import pandas as pd

from kankaku.analysis.figures.loss_diagram import loss_figure
from tools.losses import emergency_brakings


def samples(*rows: tuple[float, str, float, str]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["time_s", "train", "speed_mps", "reason"])


def test_an_emergency_braking_counts_once_however_long_it_lasts() -> None:
    table = samples(
        (0.0, "A", 20.0, "authority"),
        (0.0, "B", 20.0, "emergency"),
        (1.0, "A", 20.0, "emergency"),
        (1.0, "B", 18.5, "emergency"),
        (2.0, "A", 18.5, "emergency"),
        (2.0, "B", 17.0, "traction"),
        (3.0, "A", 17.0, "emergency"),
        (3.0, "B", 17.0, "emergency"),
    )
    assert emergency_brakings(table) == 3


def test_a_train_that_stands_without_commands_does_not_brake() -> None:
    table = samples(
        (0.0, "A", 0.0, "dwelling"), (1.0, "A", 0.0, "emergency"), (2.0, "A", 0.0, "traction")
    )
    assert emergency_brakings(table) == 0


def test_thick_lines_are_means_and_thin_ones_the_seeds() -> None:
    losses = pd.DataFrame(
        {
            "controller": ["control_map"] * 4,
            "loss_percent": [0.0, 10.0, 0.0, 10.0],
            "seed": [1, 1, 2, 2],
            "mean_arrival_delay_s": [10.0, 20.0, 12.0, 30.0],
            "emergency_brakings": [0, 4, 0, 10],
        }
    )
    delays, brakings = loss_figure(losses).axes
    drawn = {
        line.get_linewidth(): np.asarray(line.get_ydata()).tolist() for line in delays.get_lines()
    }
    assert drawn == {0.7: [12.0, 30.0], 1.8: [11.0, 25.0]}
    ends = sorted(float(np.asarray(line.get_ydata())[-1]) for line in brakings.get_lines())
    assert ends == [4.0, 7.0, 10.0]
