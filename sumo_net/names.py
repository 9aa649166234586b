"""Identifiers of what SUMO sees."""

FORBIDDEN = " \t\n\r|\\'\";,<>&%"
"""Characters that SUMO refuses in an identifier, and the escape character itself."""


def safe(name: str) -> str:
    """
    Return a name with the characters that SUMO refuses escaped.

    Parameters
    ----------
    name
        Any name.

    Returns
    -------
    str
        An identifier; different names give different identifiers.
    """
    escaped = "".join(f"%{ord(letter):02x}" if letter in FORBIDDEN else letter for letter in name)
    return f"%3a{escaped[1:]}" if escaped.startswith(":") else escaped


def section_node(boundary: int) -> str:
    """
    Return the node at which all tracks of a section begin or end.

    Parameters
    ----------
    boundary
        0 at the start of the line, the number of sections at its end. [-]

    Returns
    -------
    str
        The identifier.
    """
    return f"section#{boundary}"


def network_node(node: str) -> str:
    """
    Return a node of a network.

    Parameters
    ----------
    node
        Its identifier in the files.

    Returns
    -------
    str
        The identifier.
    """
    return f"node#{safe(node)}"


def signal_node(track: str, index: int) -> str:
    """
    Return the node of a signal within a track.

    Parameters
    ----------
    track
        Identifier of the track.
    index
        The signal stands at the start of this edge of the track. [-]

    Returns
    -------
    str
        The identifier.
    """
    return f"signal#{safe(track)}#{index}"


def limit_node(track: str, index: int) -> str:
    """
    Return the node at which the speed limit changes within a track.

    Parameters
    ----------
    track
        Identifier of the track.
    index
        The new limit holds from the start of this edge of the track. [-]

    Returns
    -------
    str
        The identifier.
    """
    return f"limit#{safe(track)}#{index}"


def edge(track: str, index: int) -> str:
    """
    Return an edge of a track.

    Parameters
    ----------
    track
        Identifier of the track.
    index
        Counted along the track from 0. [-]

    Returns
    -------
    str
        The identifier.
    """
    return f"{safe(track)}#{index}"


def lane(edge_id: str) -> str:
    """
    Return the one lane of an edge.

    Parameters
    ----------
    edge_id
        Identifier of the edge.

    Returns
    -------
    str
        The identifier.
    """
    return f"{edge_id}_0"


def route(number: int) -> str:
    """
    Return a route that trains share.

    Parameters
    ----------
    number
        Counted from 0. [-]

    Returns
    -------
    str
        The identifier.
    """
    return f"route#{number}"


def platform(station: str, track: str) -> str:
    """
    Return a platform.

    Parameters
    ----------
    station, track
        Identifiers of the station and the track.

    Returns
    -------
    str
        The identifier.
    """
    return f"{safe(station)}#{safe(track)}"


def vehicle(train: str) -> str:
    """
    Return the vehicle of a train.

    Parameters
    ----------
    train
        Name of the train.

    Returns
    -------
    str
        The identifier.
    """
    return safe(train)


def vehicle_type(train_type: str) -> str:
    """
    Return the vehicle type of a train type.

    Parameters
    ----------
    train_type
        Identifier of the train type.

    Returns
    -------
    str
        The identifier.
    """
    return safe(train_type)
