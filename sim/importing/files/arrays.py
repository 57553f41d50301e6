"""Named arrays: `.npz` of NumPy, `.mat` of MATLAB in version 5 and, with the optional h5py, in its newer form (HDF5)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput

HDF5 = b"\x89HDF\r\n\x1a\n"


def read_arrays(file: Path) -> dict[str, Any]:
    """Arrays of numbers and texts of a file by name; members of structures as `structure.member`. Raises `BadInput`."""
    with file.open("rb") as stream:
        begin = stream.read(520)
    if begin.startswith(b"PK"):
        return dict(_npz(file))
    if begin.startswith(HDF5) or begin[512:].startswith(HDF5):
        return dict(_hdf5(file))
    return dict(_mat(file))


def _npz(file: Path) -> Iterator[tuple[str, Any]]:
    try:
        with np.load(file, allow_pickle=False) as stored:
            for name in stored.files:
                yield from _flat(name, stored[name])
    except Exception as error:  # zipfile and numpy raise whatever a damaged file leads them to
        raise BadInput(f"{file}: cannot be read as .npz: {error or type(error).__name__}; arrays of numbers and texts are allowed, no objects") from None


def _mat(file: Path) -> Iterator[tuple[str, Any]]:
    from scipy.io import loadmat

    try:
        stored = loadmat(file, simplify_cells=True)
    except Exception as error:  # scipy's reader raises whatever a damaged file leads it to
        raise BadInput(f"{file}: cannot be read as .mat: {error}") from None
    for name, value in stored.items():
        if not name.startswith("__"):
            yield from _flat(name, value)


def _hdf5(file: Path) -> Iterator[tuple[str, Any]]:
    try:
        import h5py
    except ImportError:
        raise BadInput(
            f"{file}: is a .mat of version 7.3 (HDF5), which needs h5py: pip install 'thermospindle[hdf5]', or save it with -v7"
        ) from None
    found: dict[str, Any] = {}

    def visit(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and not name.startswith("#"):
            found[name.replace("/", ".")] = _matlab(node)

    try:
        with h5py.File(file, "r") as stored:
            stored.visititems(visit)
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
    elif isinstance(value, str) or (isinstance(value, np.ndarray) and value.dtype.kind in "US"):
        yield name, str(value) if np.ndim(value) == 0 else [str(v) for v in np.ravel(value)]
    elif value is not None and np.asarray(value).dtype.kind in "fciub":
        yield name, np.squeeze(np.asarray(value))
