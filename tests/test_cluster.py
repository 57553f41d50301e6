"""A study on a real Dask scheduler with several worker processes: one killed, one that no longer answers, one whose network
is cut and comes back with what it has done meanwhile; nothing lost, nothing twice. And the blind study on the same executor."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from queue import SimpleQueue

import pytest

from tests.blind import study as blind
from tests.conftest import ROOT
from tests.studies import DRAWN, files, study
from thermospindle.cli import main
from thermospindle.sim.study import parts

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("distributed") is None, reason="Dask is not installed: pip install 'thermospindle[cluster]'"),
    pytest.mark.skipif(os.name == "nt", reason="processes are stopped by signals"),
]
TEXT = DRAWN.replace("temperatures_C = [20, 60]", "temperatures_C = [20, 30, 40, 50, 60]\nspeeds_rpm = [0, 3600, 7200]") + "draws = 24\nchunk = 1\n"


def counted(monkeypatch) -> list[str]:
    """Names of the part files as they are written."""
    written: list[str] = []
    own = parts.write_table

    def write(table, file):
        written.append(file.name)
        own(table, file)

    monkeypatch.setattr(parts, "write_table", write)
    return written


class Cable:
    """A stretch of network between whoever connects to `port` and `target`: what is sent while it is cut arrives when it is mended."""

    def __init__(self, target: int):
        self.target, self.whole, self.held = target, threading.Event(), b""
        self.whole.set()
        self.server = socket.create_server(("127.0.0.1", 0))
        self.port = self.server.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self.server.accept()
                self.whole.wait()
                far = socket.create_connection(("127.0.0.1", self.target))
                for a, b in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=(a, b), daemon=True).start()

    def _carry(self, a: socket.socket, b: socket.socket) -> None:
        under_way: SimpleQueue[bytes] = SimpleQueue()
        threading.Thread(target=self._deliver, args=(under_way, b), daemon=True).start()
        data = b"-"
        while data:  # also while it is cut: what waits is seen here, not left with the system
            try:
                data = a.recv(1 << 16)
            except OSError:
                data = b""
            self.held += b"" if self.whole.is_set() else data
            under_way.put(data)

    def _deliver(self, under_way: SimpleQueue, b: socket.socket) -> None:
        with suppress(OSError):
            while data := under_way.get():
                self.whole.wait()
                b.sendall(data)
            self.whole.wait()
            b.shutdown(socket.SHUT_WR)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


@contextmanager
def worker_behind(cables: list[Cable], port: int):
    """A worker process that the scheduler and others reach, and that reaches the scheduler, through cables alone."""
    to_scheduler, to_worker = cables
    command = [sys.executable, "-m", "distributed.cli.dask_worker", f"tcp://127.0.0.1:{to_scheduler.port}", "--no-nanny", "--nthreads", "1", "--no-dashboard"]
    command += ["--listen-address", f"tcp://127.0.0.1:{port}", "--contact-address", f"tcp://127.0.0.1:{to_worker.port}"]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def studied_while(harm, file, out, address):
    """A study on a cluster, well to its end, with `harm` done meanwhile by a thread of its own."""
    thread = threading.Thread(target=harm)
    thread.start()
    try:
        assert main(["study", str(file), "--out", str(out), "--cluster", address]) == 0
    finally:
        thread.join()


def test_a_worker_cut_off_goes_on_and_delivers_again(tmp_path, capsys, monkeypatch):
    """The connections stay up and carry nothing, as when a switch is off: the scheduler gives the
    worker up, another does its work, and then all that it had sent arrives."""
    import dask
    from distributed import Client, LocalCluster

    here, _ = study(tmp_path, TEXT)
    written = counted(monkeypatch)
    there = tmp_path / "there"
    done: list[str] = []
    quick = dask.config.set({"distributed.scheduler.worker-ttl": "6s", "distributed.worker.heartbeat-interval": "500ms"})
    with quick, LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        port = free_port()
        cables = [Cable(int(cluster.scheduler_address.rpartition(":")[2])), Cable(port)]
        far = f"tcp://127.0.0.1:{cables[1].port}"
        with worker_behind(cables, port), Client(cluster.scheduler_address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
            assert far in client.scheduler_info(n_workers=-1)["workers"]

            def cut() -> None:
                until = time.monotonic() + 200
                while len(list(there.glob("parts/part-*.parquet"))) < 2 and time.monotonic() < until:
                    time.sleep(0.005)
                for cable in cables:
                    cable.whole.clear()
                done.append(f"cut after {len(list(there.glob('parts/part-*.parquet')))} parts")
                while far in client.scheduler_info(n_workers=-1)["workers"] and time.monotonic() < until:
                    time.sleep(0.05)
                done.append("given up")
                for cable in cables:
                    cable.whole.set()
                done.append("mended")

            studied_while(cut, tmp_path / "study.toml", there, cluster.scheduler_address)
    assert [d.split()[0] for d in done] == ["cut", "given", "mended"]
    assert b"task-finished" in cables[0].held, "it had nothing to deliver"
    capsys.readouterr()
    assert sorted(n for n in written if n.startswith("part-")) == [f"part-{k:06d}.parquet" for k in range(24)], "lost, or done twice"
    assert files(here) == files(there)


def judged(seed, without=()):
    """In place of a minute's diagnosis."""
    return {"seed": seed, "without": list(without), "scene": "s", "hidden": [], "sizes": [], "units": [], "verdict": "none", "effects": [], "seconds": seed / 7}


def test_the_blind_study_runs_on_a_cluster(tmp_path, capsys, monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setattr(blind, "judge", judged)
    found = {}
    with LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster:
        for name, words in (("here", []), ("there", ["--cluster", cluster.scheduler_address])):
            out = tmp_path / f"{name}.jsonl"
            for seeds in (("3", "5"), ("1", "9")):  # gone on with
                monkeypatch.setattr(sys, "argv", ["study", "--seeds", *seeds, "--out", str(out), *words])
                blind.main()
            found[name] = sorted(out.read_text(encoding="utf-8").splitlines())
    assert len(found["here"]) == 8
    assert found["here"] == found["there"]
    assert json.loads(found["here"][0])["commit"] == blind.commit()


def test_one_worker_killed_and_one_cut_off(tmp_path, capsys, monkeypatch):
    import dask
    from distributed import LocalCluster

    here, _ = study(tmp_path, TEXT)
    written = counted(monkeypatch)
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

        try:
            studied_while(harm, tmp_path / "study.toml", there, cluster.scheduler_address)
        finally:
            with suppress(ProcessLookupError):  # given up, and replaced by another
                os.kill(pids[1], signal.SIGCONT)
    assert done
    capsys.readouterr()
    assert sorted(n for n in written if n.startswith("part-")) == [f"part-{k:06d}.parquet" for k in range(24)], "lost, or done twice"
    assert files(here) == files(there)
