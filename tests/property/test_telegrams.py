"""The 150-byte telegram: what is sent arrives, and what was changed on its way is refused."""

import struct
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.radio.telegram import (
    CONTENT_BYTES,
    PACKET_BYTES,
    POINTS,
    Point,
    Telegram,
    TelegramError,
    decode,
    encode,
)

words = st.integers(0, 2**16 - 1)
singles = st.floats(width=32, allow_nan=False, allow_infinity=False)
points = st.builds(Point, words, singles, singles, singles)
telegrams = st.builds(
    Telegram,
    words,
    words,
    words,
    words,
    words,
    st.lists(points, min_size=POINTS, max_size=POINTS).map(tuple),
)
EXAMPLE = Telegram(
    time_stamp=1,
    map_serial=2,
    sender=3,
    receiver=4,
    receiver_position=5,
    points=tuple(Point(747, 28800.0 + 0.5 * k, 7800.0 + 10.0 * k, 20.0) for k in range(POINTS)),
)


@given(telegrams)
def test_what_is_sent_arrives(telegram: Telegram) -> None:
    packet = encode(telegram)
    assert len(packet) == PACKET_BYTES
    assert decode(packet) == telegram


@given(telegrams, st.sets(st.integers(0, 8 * PACKET_BYTES - 1), min_size=1, max_size=3))
def test_up_to_three_wrong_bits_are_noticed(telegram: Telegram, bits: set[int]) -> None:
    packet = bytearray(encode(telegram))
    for bit in bits:
        packet[bit // 8] ^= 1 << bit % 8
    with pytest.raises(TelegramError, match="checksum"):
        decode(bytes(packet))


@given(telegrams, st.integers(0, CONTENT_BYTES - 4), st.integers(1, 2**32 - 1))
def test_a_burst_of_four_bytes_is_noticed(telegram: Telegram, start: int, burst: int) -> None:
    packet = bytearray(encode(telegram))
    for place, byte in enumerate(burst.to_bytes(4, "big")):
        packet[start + place] ^= byte
    with pytest.raises(TelegramError, match="checksum"):
        decode(bytes(packet))


@given(st.binary(max_size=2 * PACKET_BYTES))
def test_noise_is_never_a_telegram(noise: bytes) -> None:
    with pytest.raises(TelegramError):
        decode(noise)


def test_the_layout_is_the_published_one() -> None:
    # Table 1: five numbers of 2 bytes, then ten times 2 + 4 + 4 + 4 bytes.
    content = encode(EXAMPLE)[:CONTENT_BYTES]
    assert len(content) == 5 * 2 + 10 * 14 == 150
    assert struct.unpack(">5H", content[:10]) == (1, 2, 3, 4, 5)
    assert struct.unpack(">Hfff", content[24:38]) == (747, 28800.5, 7810.0, 20.0)


def test_a_place_is_kept_to_two_millimetres() -> None:
    odd = Point(1, 32399.9, 23999.999, 24.9)
    telegram = Telegram(0, 0, 0, 0, 0, (odd,) * POINTS)
    received = decode(encode(telegram)).points[0]
    assert received.position_m == pytest.approx(odd.position_m, abs=0.002)
    assert received.time_s == pytest.approx(odd.time_s, abs=0.002)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(TelegramError, match="10 points, not 9"):
        encode(Telegram(0, 0, 0, 0, 0, EXAMPLE.points[:9]))
    with pytest.raises(TelegramError, match="65536 does not fit"):
        encode(Telegram(0, 65536, 0, 0, 0, EXAMPLE.points))
    with pytest.raises(TelegramError, match="four bytes"):
        encode(Telegram(0, 0, 0, 0, 0, (Point(1, 0.0, 1e300, 0.0),) * POINTS))


def test_what_is_no_number_is_refused_although_its_checksum_fits() -> None:
    content = bytearray(encode(EXAMPLE)[:CONTENT_BYTES])
    content[12:16] = struct.pack(">f", float("nan"))
    packet = bytes(content) + struct.pack(">I", zlib.crc32(content)) + bytes(26)
    with pytest.raises(TelegramError, match="not a number"):
        decode(packet)
