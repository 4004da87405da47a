"""The recipes of `docs/clusters.md` that need no administrator."""

import subprocess
import sys
import textwrap

import pytest

import gearlash as gl
from conftest import PAIR


def test_shards_on_hyperqueue(tmp_path, program):
    pytest.importorskip("hyperqueue")
    (tmp_path / "pair.yaml").write_text(PAIR)
    # In a process of its own: the server of HyperQueue lives in threads that pytest would wait for.
    script = textwrap.dedent(
        f"""
        from hyperqueue import Job, LocalCluster
        from hyperqueue.cluster import WorkerConfig
        with LocalCluster() as cluster:
            cluster.start_worker(WorkerConfig(cores=2))
            client = cluster.client()
            job = Job()
            for k in (1, 2, 3):
                job.program([{program!r}, "run", "pair.yaml", "--only", "grid", "--jobs", "1", "--quiet", "--shard", f"{{k}}/3",
                             "--out", f"parts/{{k}}"], cwd={str(tmp_path)!r})
            assert client.wait_for_jobs([client.submit(job)])
        """
    )
    subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, timeout=120, cwd=tmp_path)
    gearlash = lambda *arguments: subprocess.run([program, *arguments], capture_output=True, text=True, cwd=tmp_path)
    # A part that is absent is named, with its command.
    partial = gearlash("merge", "parts/1", "parts/3", "--out", "none")
    assert partial.returncode == 2 and "--shard 2/3 --out parts/2" in partial.stderr
    assert gearlash("merge", "parts/1", "parts/2", "parts/3", "--out", "all", "--quiet").returncode == 0
    assert gearlash("run", "pair.yaml", "--only", "grid", "--out", "one", "--quiet").returncode == 0
    merged = (tmp_path / "all/grid.csv").read_bytes()
    assert merged == (tmp_path / "one/grid.csv").read_bytes()
    rows = gl.Model(PAIR).run("grid").main
    assert len(merged.splitlines()) == rows.num_rows + 1
