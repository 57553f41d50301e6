"""What goes wrong in one sentence: the command line prints it and ends with exit code 2."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Protocol, TypeVar
from unicodedata import category

LONGEST = 3000  # letters of a message


class BadInput(ValueError):
    """A file, key, value or option that cannot be used; the message names it and says what is allowed.

    What a damaged file makes endless is told by its beginning and its end.
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(message if len(message) <= LONGEST else f"{message[: LONGEST // 2]} ... {message[-LONGEST // 3 :]}")


class Unanswered(BadInput):
    """Several things that only the user knows, asked for at once: `items` are sentences, `head` says what they are for."""

    def __init__(self, head: str, items: Iterable[str], tail: str = "") -> None:
        self.head, self.items, self.tail = head, tuple(items), tail
        super().__init__(" ".join([head, *(f"({k}) {item};" for k, item in enumerate(self.items, 1)), tail]).rstrip("; "))


class OutsideRange(ValueError):
    """A table or law was asked outside the range it was made for."""


class NoEquilibrium(RuntimeError):
    """A bearing, or a set of bearings, finds no balance of its forces."""


class NotConverged(RuntimeError):
    """A numerical method did not reach the accuracy asked of it."""


def instead(word: str, known: Iterable[str]) -> str:
    """What to say after an unknown `word`: the known one it is most like, or all that are known."""
    names = list(known)
    part = [name for name in names if word and (name.startswith(word) or word.startswith(name))]
    part += [name for name in names if word and all(any(own.startswith(w) for own in name.split()) for w in word.split())]
    near = [*part, *get_close_matches(word, names, n=1)]
    return f"did you mean {near[0]}?" if near else f"allowed are {', '.join(names) or 'none'}"


class Named(Protocol):
    @property
    def name(self) -> str: ...


T = TypeVar("T", bound=Named)


def named(name: str, things: Iterable[T], what: str) -> T:
    """The one of some things that has a name; `BadInput` where none has, `what` being what they are."""
    every = tuple(things)
    for thing in every:
        if thing.name == name:
            return thing
    raise BadInput(f"no {what} is called {name!r}; {instead(str(name), [t.name for t in every])}")


def listed(names: Sequence[str]) -> str:
    """a; a and b; a, b and c."""
    return ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1] if names else ""


def absent(file: Path) -> str:
    """Why what is no file cannot be read as one."""
    return "it is a folder" if file.is_dir() else "no such file"


def visible(text: str) -> str:
    """Text of a file as a terminal may show it: what it would obey (escape sequences) and what it
    cannot show (half a pair of surrogates) is written out."""
    return "".join(letter if letter in "\n\t" or category(letter) not in ("Cc", "Cs") else repr(letter)[1:-1] for letter in text)
