"""Damage: bytes cut, flipped, put in, said twice; numbers made huge, negative, nothing; counts that are wrong."""

from __future__ import annotations

import random
import re
from dataclasses import dataclass

from hypothesis import strategies as st

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
VALUES = (b"0", b"-1", b"1e400", b"-1e308", b"1e-320", b"nan", b"inf", b"9" * 30, b"9" * 5000, b"1_000", b"2147483648", b"-2147483649", b"18446744073709551616", b'"x"', b"", b"[]", b"{}", b"true", b"0x1f", b"1979-05-27", "\u0664".encode(), b"null", b"1 2")  # fmt: skip
BITS = (b"\x00", b"\xff", b"\xfe\xff", b"[", b"]", b"{", b"}", b'"', b"'", b",", b"\n", b"\r", b"=", b"\x1b[31m", b"../", b"/", b"[/x]", b"\xc3", "\u2028".encode(), b"[" * 3000, b"{a=" * 1500)  # fmt: skip


@dataclass(frozen=True)
class Damage:
    """One thing done to a file at a share of its length (or to one of its numbers)."""

    what: str
    where: float
    value: bytes = b""
    length: float = 0.0

    def __call__(self, data: bytes) -> bytes:
        at = int(self.where * len(data))
        end = min(len(data), at + max(1, int(self.length * len(data))))
        match self.what:
            case "cut":
                return data[:at]
            case "take out":
                return data[:at] + data[end:]
            case "put in":
                return data[:at] + self.value + data[at:]
            case "flip":
                return data[:at] + bytes(b ^ 1 << (k % 8) for k, b in enumerate(data[at : at + 3])) + data[at + 3 :]
            case "twice":
                return data[:end] + data[at:]
            case "number":
                found = list(NUMBER.finditer(data[:200_000]))
                if not found:
                    return data
                own = found[int(self.where * len(found))]
                return data[: own.start()] + self.value + data[own.end() :]
            case "line":
                lines = data.split(b"\n")
                del lines[int(self.where * len(lines))]
                return b"\n".join(lines)
        raise AssertionError(self.what)


_where = st.floats(0, 1, exclude_max=True)
_one = st.one_of(
    st.builds(Damage, st.just("number"), _where, st.sampled_from(VALUES)),
    st.builds(Damage, st.just("put in"), _where, st.one_of(st.sampled_from(BITS), st.binary(min_size=1, max_size=7))),
    st.builds(Damage, st.sampled_from(["cut", "flip", "line"]), _where),
    st.builds(Damage, st.sampled_from(["take out", "twice"]), _where, st.just(b""), st.floats(0, 0.2)),
)
damages = st.lists(_one, min_size=1, max_size=4)


def drawn(rng: random.Random) -> Damage:
    """One of the same kinds, for the fuzzer, that draws by itself."""
    match rng.choice(("number", "number", "put in", "bytes", "small", "piece")):
        case "number":
            return Damage("number", rng.random(), rng.choice(VALUES))
        case "put in":
            return Damage("put in", rng.random(), rng.choice(BITS))
        case "bytes":
            return Damage("put in", rng.random(), rng.randbytes(rng.randint(1, 7)))
        case "small":
            return Damage(rng.choice(("cut", "flip", "line")), rng.random())
    return Damage(rng.choice(("take out", "twice")), rng.random(), b"", 0.2 * rng.random())


def damaged(data: bytes, every: list[Damage]) -> bytes:
    for one in every:
        data = one(data)
    return data
