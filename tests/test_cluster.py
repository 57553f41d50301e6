"""A study on a real Dask scheduler with several worker processes: one killed, one that no longer answers; nothing lost, nothing twice."""

import os
import signal
import threading
import time
from contextlib import suppress
from importlib.util import find_spec

import pytest

from tests.test_study import DRAWN, files, study
from thermospindle.cli import main
from thermospindle.sim.study import parts

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed: pip install 'thermospindle[cluster]'"),
    pytest.mark.skipif(os.name == "nt", reason="processes are stopped by signals"),
]
TEXT = DRAWN.replace("temperatures_C = [20, 60]", "temperatures_C = [20, 30, 40, 50, 60]\nspeeds_rpm = [0, 3600, 7200]") + "draws = 24\nchunk = 1\n"


def test_one_worker_killed_and_one_cut_off(tmp_path, capsys, monkeypatch):
    import dask
    from distributed import LocalCluster

    here, _ = study(tmp_path, TEXT)
    written: list[str] = []
    own = parts.write_table

    def counted(table, file):
        written.append(file.name)
        own(table, file)

    monkeypatch.setattr(parts, "write_table", counted)
    there = tmp_path / "there"
    # the scheduler gives a worker up that says nothing for so long: its network may be cut, or it is stopped
    quick = dask.config.set({"distributed.scheduler.worker-ttl": "25s", "distributed.worker.heartbeat-interval": "1s"})
    with quick, LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        pids = [nanny.pid for nanny in cluster.workers.values()]
        assert len(set(pids)) == 3
        done: list[str] = []

        def harm() -> None:
            until = time.monotonic() + 300
            while len(list(there.glob("parts/part-*.parquet"))) < 4 and time.monotonic() < until:
                time.sleep(0.01)
            os.kill(pids[0], signal.SIGKILL)
            os.kill(pids[1], signal.SIGSTOP)
            done.append(f"after {len(list(there.glob('parts/part-*.parquet')))} parts")

        thread = threading.Thread(target=harm)
        thread.start()
        try:
            assert main(["study", str(tmp_path / "study.toml"), "--out", str(there), "--cluster", cluster.scheduler_address]) == 0
        finally:
            thread.join()
            with suppress(ProcessLookupError):  # given up, and replaced by another
                os.kill(pids[1], signal.SIGCONT)
    assert done
    capsys.readouterr()
    assert sorted(n for n in written if n.startswith("part-")) == [f"part-{k:06d}.parquet" for k in range(24)], "lost, or done twice"
    assert files(here) == files(there)
