"""Studies run from the command line, for tests that look at what they wrote."""

import pyarrow.parquet as pq

from thermospindle.cli import main

DRAWN = 'title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20, 60]\n'
COMPARED = 'title = "t"\nkind = "comparison"\nscenes = ["hdd_2003", "mk7702"]\ntemperatures_C = [20]\nspeeds_rpm = [7200]\n'


def study(folder, text, *options):
    """The answer of a study file, and its rows."""
    file = folder / "study.toml"
    file.write_text(text, encoding="utf-8")
    out = folder / "out"
    assert main(["study", str(file), "--out", str(out), "--json", *options]) == 0
    return out, pq.read_table(out / "results.parquet").to_pylist()


def files(folder):
    """All but the log, which holds when it was written."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.suffix != ".rrd"}
