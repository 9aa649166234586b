"""The telegram from the controller to a train: 150 bytes of content in a packet of 180."""

import math
import struct
import zlib
from dataclasses import dataclass

CONTENT_BYTES = 150
PACKET_BYTES = 180
POINTS = 10
POINT_STEP_S = 0.5
"""Time between two points of a command, so that it reaches 5 s ahead. [s]"""
_WORD_MAX = 2**16 - 1
_HEADER = struct.Struct(">5H")
_POINT = struct.Struct(">H3f")
_CHECK = struct.Struct(">I")
_RESERVED = bytes(PACKET_BYTES - CONTENT_BYTES - _CHECK.size)


class TelegramError(ValueError):
    """A packet that no train may act on, or a telegram that no packet can hold."""


@dataclass(frozen=True, slots=True)
class Point:
    """Where a train is to be, and how fast, at one moment of its run curve."""

    train: int
    time_s: float
    position_m: float
    speed_mps: float


@dataclass(frozen=True, slots=True)
class Telegram:
    """
    A command: the next 5 s of a run curve.

    Numbers of the header are whole and fit into 16 bits; what they count is the sender's affair.
    """

    time_stamp: int
    map_serial: int
    """The control map that the command is taken from."""
    sender: int
    receiver: int
    receiver_position: int
    """By which the radio unit is found."""
    points: tuple[Point, ...]


def encode(telegram: Telegram) -> bytes:
    """
    Return a telegram as the packet that is sent.

    The content has the published layout, big-endian. The published packet has 30 bytes for "check
    codes and so on": here they are a CRC-32 over the content and 26 bytes that are zero.

    Parameters
    ----------
    telegram
        What to send.

    Returns
    -------
    bytes
        The packet, ``PACKET_BYTES`` long.

    Raises
    ------
    TelegramError
        If a number does not fit into its field, or there are not ten points.

    References
    ----------
    .. [1] Sugiyama et al. 2018, table 1 and section 3.1.4.
    """
    if len(telegram.points) != POINTS:
        msg = f"a telegram has {POINTS} points, not {len(telegram.points)}"
        raise TelegramError(msg)
    words = (
        telegram.time_stamp,
        telegram.map_serial,
        telegram.sender,
        telegram.receiver,
        telegram.receiver_position,
    )
    for word in (*words, *(point.train for point in telegram.points)):
        if not 0 <= word <= _WORD_MAX:
            msg = f"{word} does not fit into two bytes; allowed: 0 to {_WORD_MAX}"
            raise TelegramError(msg)
    try:
        content = _HEADER.pack(*words) + b"".join(
            _POINT.pack(point.train, point.time_s, point.position_m, point.speed_mps)
            for point in telegram.points
        )
    except OverflowError as error:
        msg = "a time, place or speed does not fit into a number of four bytes"
        raise TelegramError(msg) from error
    return content + _CHECK.pack(zlib.crc32(content)) + _RESERVED


def decode(packet: bytes) -> Telegram:
    """
    Return the telegram in a packet.

    Parameters
    ----------
    packet
        As received.

    Returns
    -------
    Telegram
        What was sent. Times, places and speeds have the precision of four bytes, 2 mm at 24 km.

    Raises
    ------
    TelegramError
        If the packet has another length, its checksum does not fit, or it holds what is no number.

    References
    ----------
    .. [1] Sugiyama et al. 2018, table 1.
    """
    if len(packet) != PACKET_BYTES:
        msg = f"a packet has {PACKET_BYTES} bytes, not {len(packet)}"
        raise TelegramError(msg)
    content, rest = packet[:CONTENT_BYTES], packet[CONTENT_BYTES:]
    if rest != _CHECK.pack(zlib.crc32(content)) + _RESERVED:
        msg = "the checksum does not fit: the packet was changed on its way"
        raise TelegramError(msg)
    points = tuple(Point(*fields) for fields in _POINT.iter_unpack(content[_HEADER.size :]))
    if not all(
        math.isfinite(value)
        for point in points
        for value in (point.time_s, point.position_m, point.speed_mps)
    ):
        msg = "a time, place or speed is not a number"
        raise TelegramError(msg)
    stamp, serial, sender, receiver, position = _HEADER.unpack_from(content)
    return Telegram(stamp, serial, sender, receiver, position, points)
