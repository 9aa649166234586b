"""Units of columns and keys, by the end of their names."""

UNITS = {
    "_kn_per_kmh2": "kN/(km/h)^2",
    "_kn_per_kmh": "kN/(km/h)",
    "_n_per_t_kmh2": "N/t/(km/h)^2",
    "_n_per_t_kmh": "N/t/(km/h)",
    "_n_per_t": "N/t",
    "_ns2pm2": "N s2/m2",
    "_nspm": "N s/m",
    "_n": "N",
    "_permil_m": "permil m",
    "_h_per_year": "h/year",
    "_per_year": "1/year",
    "_per_hour": "1/h",
    "_mps3": "m/s3",
    "_kmhps": "km/h/s",
    "_kmh": "km/h",
    "_km": "km",
    "_m": "m",
    "_s": "s",
    "_min": "min",
    "_h": "h",
    "_t": "t",
    "_kn": "kN",
    "_kw": "kW",
    "_kbps": "kbit/s",
    "_bytes": "byte",
    "_percent": "%",
    "_permil": "permil",
    "_deg": "degree",
}
"""Longer endings before shorter ones that they end with."""
_WHOLE = {"km": "km", "force_speed": "km/h, kN"}


def unit_of(name: str) -> str:
    """
    Return the unit of a column or key.

    Parameters
    ----------
    name
        Its name.

    Returns
    -------
    str
        The unit; empty if it has none.
    """
    ending = next((end for end in UNITS if name.endswith(end)), "")
    return _WHOLE.get(name, UNITS.get(ending, ""))
