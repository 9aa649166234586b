"""What a user may ask for, and within which bounds; imports next to nothing."""

from enum import Enum

STEP_RANGE_S = (0.01, 0.5)
SEED_MAX = 2**63 - 1
MOST_SEEDS = 100_000
STUDY_SEEDS = 100
"""Seeds that a study of very many runs has if nobody says how many. [-]"""
MOST_JOBS = 10_000
CAMPAIGN_PROTECTION = "control_map"
"""Protection whose units a campaign lets fail; also the controller that it takes by default."""
CAMPAIGN_RUNS = 1000
YEARS = 100_000
"""Years of failures that are simulated."""
MOST_YEARS = 10_000_000


class Check(Enum):
    """Which headways to check by simulation."""

    ALL = "all"
    CRITICAL = "critical"
    NONE = "none"
