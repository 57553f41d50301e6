"""What the fuzzer found worth keeping, once more: a result or a named error. Needs no atheris."""

import pytest

from tests.conftest import ROOT
from tests.torture.conftest import outcome
from tests.torture.readers import READERS

CORPUS = ROOT / "tests" / "fuzz" / "corpus"
KEPT = sorted(folder.name for folder in CORPUS.iterdir())


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in ("log", "mat") else n for n in KEPT])
def test_the_corpus_again(name, tmp_path):
    files = sorted((CORPUS / name).iterdir())
    assert files
    for file in files:
        with outcome(f"{name}, corpus"):
            READERS[name](tmp_path / name, file.read_bytes())


def test_the_corpus_is_small():
    assert len(KEPT) > 8
    assert set(KEPT) <= set(READERS)
    assert sum(f.stat().st_size for f in CORPUS.rglob("*") if f.is_file()) < 400_000
