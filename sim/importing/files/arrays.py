"""Named arrays: `.npz` of NumPy, `.mat` of MATLAB in version 5 and, with the optional h5py, in its newer form (HDF5)."""

from __future__ import annotations

import json
import struct
import sys
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.files.apart import read_apart

HDF5 = b"\x89HDF\r\n\x1a\n"


LARGEST = 1 << 30
"""Bytes that the arrays of one file may unpack to: a small file that unpacks to more than that is damaged, or was made to fill a memory."""
STEP = 1 << 20
COMPRESSED = 15  # type of an element of a .mat file in version 5


def read_arrays(file: Path) -> dict[str, Any]:
    """Arrays of numbers and texts of a file by name; members of structures as `structure.member`. Raises `BadInput`."""
    with file.open("rb") as stream:
        begin = stream.read(520)
    if begin.startswith(b"PK"):
        return dict(_npz(file))
    if _is_hdf5(begin) and find_spec("h5py") is None:
        raise BadInput(
            f"{file}: is a .mat of version 7.3 (HDF5), which needs h5py: pip install 'thermospindle[hdf5]', or save it with -v7"
        )
    return _apart(file)


def _is_hdf5(begin: bytes) -> bool:
    return begin.startswith(HDF5) or begin[512:].startswith(HDF5)


APART = "import sys; from thermospindle.sim.importing.files.arrays import hand_over; sys.exit(hand_over(*sys.argv[1:]))"
REFUSED = 3  # exit code of a process that has said why


def _apart(file: Path) -> dict[str, Any]:
    """What another process reads of a `.mat` file: the compiled readers of SciPy and HDF5 break off
    the process that they are in on some damaged files, or never end."""
    with TemporaryDirectory() as place:
        found = Path(place) / "arrays.npz"
        done = read_apart(file, ".mat files", APART, str(file), str(found), str(LARGEST), ends=(0, REFUSED))
        if done.returncode == REFUSED:
            raise BadInput(done.stderr.strip())
        with np.load(found, allow_pickle=False) as stored:
            names = json.loads(str(stored["names"]))
            return {name: _told(stored[f"arr_{k}"]) for k, name in enumerate(names)}


def _told(value: np.ndarray) -> Any:
    return value if value.dtype.kind != "U" else value.tolist()


def hand_over(file: str, found: str, largest: str) -> int:
    """The other process: reads a `.mat` file and writes its arrays and texts to the file `found`; an exit code."""
    global LARGEST
    LARGEST = int(largest)
    try:
        with Path(file).open("rb") as stream:
            begin = stream.read(520)
        arrays = dict((_hdf5 if _is_hdf5(begin) else _mat)(Path(file)))
    except BadInput as error:
        print(error, file=sys.stderr)
        return REFUSED
    with open(found, "wb") as stream:
        np.savez(stream, *(np.asarray(value) for value in arrays.values()), names=np.asarray(json.dumps(list(arrays))))
    return 0


def _npz(file: Path) -> Iterator[tuple[str, Any]]:
    try:
        with zipfile.ZipFile(file) as packed:
            _refuse_larger(file, sum(member.file_size for member in packed.infolist()))
        with np.load(file, allow_pickle=False) as stored:
            for name in stored.files:
                yield from _flat(name, stored[name])
    except BadInput:
        raise
    except Exception as error:  # zipfile and numpy raise whatever a damaged file leads them to
        raise BadInput(f"{file}: cannot be read as .npz: {error or type(error).__name__}; arrays of numbers and texts are allowed, no objects") from None


def _refuse_larger(file: Path, count: int) -> None:
    if count > LARGEST:
        raise BadInput(f"{file}: unpacks to {count / 1e6:.0f} MB or more; at most {LARGEST / 1e6:.0f} MB are read from one file")


def _unpacked(file: Path) -> int:
    """Bytes that the elements of a .mat file in version 5 unpack to, counted until they are too many; of what is none its own size."""
    total = file.stat().st_size
    with file.open("rb") as stream:
        head = stream.read(128)
        order = {b"IM": "<", b"MI": ">"}.get(head[126:128])
        while order is not None and len(tag := stream.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            if kind != COMPRESSED:
                stream.seek(size, 1)
                continue
            end, unpacking = stream.tell() + size, zlib.decompressobj()
            while (rest := end - stream.tell()) > 0 and (packed := stream.read(min(STEP, rest))):
                while packed and total <= LARGEST:
                    total += len(unpacking.decompress(packed, STEP))
                    packed = unpacking.unconsumed_tail
                if total > LARGEST:
                    return total
    return total


def _mat(file: Path) -> Iterator[tuple[str, Any]]:
    from scipy.io import loadmat

    try:
        _refuse_larger(file, _unpacked(file))
        stored = loadmat(file, simplify_cells=True)
    except BadInput:
        raise
    except Exception as error:  # scipy's reader raises whatever a damaged file leads it to
        raise BadInput(f"{file}: cannot be read as .mat: {error}") from None
    for name, value in stored.items():
        if not name.startswith("__"):
            yield from _flat(name, value)


def _hdf5(file: Path) -> Iterator[tuple[str, Any]]:
    import h5py

    found: dict[str, Any] = {}
    bytes_of: list[int] = []

    def visit(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and not name.startswith("#"):
            bytes_of.append(int(node.nbytes))
            _refuse_larger(file, sum(bytes_of))
            found[name.replace("/", ".")] = _matlab(node)

    try:
        with h5py.File(file, "r") as stored:
            stored.visititems(visit)
    except BadInput:
        raise
    except Exception as error:  # as h5py does
        raise BadInput(f"{file}: cannot be read as HDF5: {error}") from None
    for name, value in found.items():
        yield from _flat(name, value)


def _matlab(node: Any) -> Any:
    """A dataset as MATLAB means it: its axes reversed, real and imaginary parts joined, characters as text."""
    value = np.asarray(node[()])
    if value.dtype.names and {"real", "imag"} <= set(value.dtype.names):
        value = value["real"] + 1j * value["imag"]
    if node.attrs.get("MATLAB_class") == b"char":
        return "".join(map(chr, np.ravel(value.T)))
    return value.T if value.dtype.kind in "fciub" else None


def _flat(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for key, member in value.items():
            yield from _flat(f"{name}.{key}", member)
    elif isinstance(value, list | np.ndarray) and len(np.shape(value)) == 1 and len(value) and all(isinstance(v, str) for v in value):  # a cell array
        yield name, [v.strip() for v in value]
    elif isinstance(value, str) or (isinstance(value, np.ndarray) and value.dtype.kind in "US"):
        yield name, str(value) if np.ndim(value) == 0 else [str(v) for v in np.ravel(value)]
    elif value is not None and np.asarray(value).dtype.kind in "fciub":
        yield name, np.squeeze(np.asarray(value))
