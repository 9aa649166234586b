"""Places on the earth, and names of places as identifiers."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import accumulate, pairwise

from kankaku.railway.plan.earth import distance_m
from kankaku.scenarios.drafts.unused_names import unused

_OTHER = re.compile(r"[^A-Za-z0-9]+")
_LONGEST_ID = 40


def along_km(places: Sequence[Sequence[float]]) -> list[float]:
    """
    Return chainages of places one after the other.

    Parameters
    ----------
    places
        Longitudes and latitudes. [deg], shape (n, 2)

    Returns
    -------
    list[float]
        From 0 on, to the metre. [km], shape (n,)
    """
    legs_m = (distance_m(one, other) for one, other in pairwise(places))
    return [round(place_m / 1000.0, 3) for place_m in accumulate(legs_m, initial=0.0)]


def identifiers(names: Iterable[str], *, small: bool = True) -> list[str]:
    """
    Return identifiers that files may have.

    Parameters
    ----------
    names
        Any texts.
    small
        Whether all letters become small ones.

    Returns
    -------
    list[str]
        Letters and digits of each, with ``-`` between; all different.
    """
    found: dict[str, None] = {}
    for name in names:
        # Letters without their accents; what has no Latin letters gets a number.
        plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        stem = _OTHER.sub("-", plain).strip("-")[:_LONGEST_ID] or "x"
        stem = stem.lower() if small else stem
        found[unused(stem, found)] = None
    return list(found)
