"""Field units to SI units."""


def metres(chainage_km: float) -> float:
    """
    Return metres; whole millimetres, so that equal chainages stay equal.

    Parameters
    ----------
    chainage_km
        Chainage as the files have it. [km]

    Returns
    -------
    float
        The same. [m]
    """
    return round(1000.0 * chainage_km, 3)
