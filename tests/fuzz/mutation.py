"""Damage to a file: a few random changes of the kind that bad disks, bad programs and attackers make."""

import bz2
import gzip
import lzma
import random
import struct
import zlib

PACKERS = {b"\x1f\x8b": gzip, b"BZh": bz2, b"\xfd7zXZ": lzma}

NUMBERS = [0, 1, 2, 7, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1]
WORDS = [
    "0",
    "-1",
    "1e999",
    "nan",
    "inf",
    "99999999999",
    "2147483648",
    "",
    "x",
    "(",
    ")",
    "none",
    "%s",
    "\0",
    "../..",
    "1 2",
]


def mutated(content: bytes, draws: random.Random) -> bytes:
    """One to eight changes; of a packed file also inside the packing."""
    packer = next((module for start, module in PACKERS.items() if content.startswith(start)), None)
    if packer is not None and draws.random() < 0.7:
        try:
            return packer.compress(mutated(packer.decompress(content), draws))
        except (OSError, EOFError, ValueError, zlib.error, lzma.LZMAError):
            pass
    changed = bytearray(content)
    for _ in range(draws.choice([1, 1, 1, 2, 3, 8])):
        if not changed:
            break
        draws.choice(CHANGES)(changed, draws)
    return bytes(changed)


def _place(content: bytearray, draws: random.Random) -> int:
    """Anywhere, but mostly in the header."""
    limit = len(content) if draws.random() < 0.3 else min(len(content), 700)
    return draws.randrange(limit)


def flip_bit(content, draws):
    content[_place(content, draws)] ^= 1 << draws.randrange(8)


def set_byte(content, draws):
    content[_place(content, draws)] = draws.choice(
        [0, 1, 0x20, 0x2D, 0x39, 0x7F, 0x80, 0xFF, draws.randrange(256)]
    )


def set_number(content, draws):
    code = draws.choice("BHIQbhiqfd")
    number = draws.choice(NUMBERS)
    if code in "fd":
        packed = struct.pack(
            draws.choice("<>") + code, draws.choice([0.0, -1.0, 1e30, float("nan"), float("inf")])
        )
    else:
        size = struct.calcsize("<" + code)
        packed = (number % 2 ** (8 * size)).to_bytes(size, draws.choice(["little", "big"]))
    place = _place(content, draws)
    content[place : place + len(packed)] = packed


def set_word(content, draws):
    """Replace a number or a word of a text header."""
    place = _place(content, draws)
    while place < len(content) and content[place : place + 1] in b" \n:=,":
        place += 1
    end = place
    while end < len(content) and content[end : end + 1] not in b" \n:=,":
        end += 1
    content[place : min(end, place + 40)] = draws.choice(WORDS).encode()


def cut(content, draws):
    del content[_place(content, draws) :]


def remove(content, draws):
    place = _place(content, draws)
    del content[place : place + draws.choice([1, 2, 4, 8, 100])]


def insert(content, draws):
    place = _place(content, draws)
    content[place:place] = draws.choice([b"\0", b"\n", b" ", b"\xff" * 4, bytes(100)])


def repeat(content, draws):
    place = _place(content, draws)
    content[place:place] = content[place : place + draws.choice([4, 16, 64])]


def exchange(content, draws):
    one, two = _place(content, draws), _place(content, draws)
    piece = content[one : one + 8]
    content[two : two + len(piece)] = piece


CHANGES = [
    flip_bit,
    set_byte,
    set_number,
    set_number,
    set_word,
    set_word,
    cut,
    remove,
    insert,
    repeat,
    exchange,
]
