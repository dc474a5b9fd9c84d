"""Damage to files, for every room's tests."""

from __future__ import annotations


def flipped(data: bytes, at: int, bit: int) -> bytes:
    """Return bytes of which one has a bit flipped."""
    return data[:at] + bytes([data[at] ^ (1 << bit)]) + data[at + 1 :]
