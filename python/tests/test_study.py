"""Studies: the same table on threads, on a cluster, after interruptions."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import polars
import pyarrow.dataset
import pytest

import gearlash as gl
from conftest import PAIR

GRID = {"mesh.half_gap": np.linspace(1e-5, 5e-5, 12), "A.mean": [80.0, 90.0, 100.0, 110.0]}
COLLECT = {"largest": ("rms.mesh", "max"), "folds": {"table": "events", "reduce": "count", "where": {"kind": "fold"}}}


@pytest.fixture
def study(pair):
    return pair.study(grid=GRID, analysis="speed", collect=COLLECT)


@pytest.fixture
def expected(study):
    return study.run()


def test_a_study_is_built_from_python(study, pair, expected):
    assert study.runs == 48 and study.columns[0] == "run" and study.columns[-3:] == ["status", "reason", "warnings"]
    assert expected.main.num_rows == 48 and set(expected.main["status"]) == {"complete"}
    rows = study.rows(10, 13)
    assert list(rows["run"]) == [10, 11, 12]
    assert np.array_equal(rows["largest"], expected.main["largest"][10:13])
    frame = polars.DataFrame({"mesh.half_gap": [1e-5, 2e-5], "A.mean": [80.0, 90.0]})
    for listed in (frame, frame.to_pandas(), frame.to_dicts(), {"mesh.half_gap": [1e-5, 2e-5], "A.mean": [80.0, 90.0]}):
        assert pair.study(list=listed, analysis="speed", collect=COLLECT).runs == 2
    with pytest.raises(gl.ModelError, match="different lengths"):
        pair.study(list={"a": [1], "b": [1, 2]}, analysis="speed", collect=COLLECT)
    with pytest.raises(gl.ModelError, match="wanted \\(column, reduce\\)"):
        pair.study(grid=GRID, analysis="speed", collect={"x": ("a",)})


@pytest.mark.parametrize("options", [{"jobs": 1}, {"jobs": 3}, {"bundle": 1}, {"bundle": 7, "jobs": 2}, {"bundle": 1000}])
def test_threads_and_bundles_change_nothing(study, expected, options):
    result = study.run(**options)
    assert result.main == expected.main and result._parts["figure"] == expected._parts["figure"]
    assert result.summary["runs"] == expected.summary["runs"]


def test_a_data_set_goes_on_where_it_was(tmp_path, study, expected, pair):
    whole = study.run(out=tmp_path / "a", bundle=5)
    assert whole.is_complete and len(whole.files) == 10
    _compare(whole, expected)
    files = {path.name: path.read_bytes() for path in whole.files}
    kept = whole.files[3].stat().st_mtime_ns
    whole.files[7].unlink()
    whole.files[0].unlink()
    assert whole.finished == 38
    again = study.run(out=tmp_path / "a")
    assert {path.name: path.read_bytes() for path in again.files} == files
    assert again.files[3].stat().st_mtime_ns == kept
    other = pair.study(grid={"mesh.half_gap": [1e-5]}, analysis="speed", collect=COLLECT)
    with pytest.raises(gl.ModelError, match="holds another study"):
        other.run(out=tmp_path / "a")
    with pytest.raises(gl.ModelError, match="begun with 5"):
        study.run(out=tmp_path / "a", bundle=6)
    assert json.loads((tmp_path / "a/study.json").read_text())["runs"] == 48
    dataset = pyarrow.dataset.dataset([str(path) for path in again.files])
    assert dataset.count_rows() == 48


def _compare(data, expected):
    frame = data.to_polars()
    table = polars.DataFrame(expected.main)
    assert frame.equals(table)


KILLED = """
import sys, gearlash as gl, numpy as np
sys.path.insert(0, {tests!r})
from test_study import GRID, COLLECT
from conftest import PAIR
print("begun", flush=True)
gl.Model(PAIR).study(grid=GRID, analysis="speed", collect=COLLECT).run(out={out!r}, bundle=1, jobs=1)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_study_loses_unfinished_bundles_only(tmp_path, study, expected, number):
    script = KILLED.format(tests=os.path.dirname(__file__), out=str(tmp_path / "a"))
    process = subprocess.Popen([sys.executable, "-W", "ignore", "-c", script], stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"begun\n"
    until = time.monotonic() + 30
    while len(list(tmp_path.glob("a/part-*.parquet"))) < 2 and time.monotonic() < until:
        time.sleep(0.002)
    process.send_signal(number)
    process.wait(timeout=30)
    there = len(list(tmp_path.glob("a/part-*.parquet")))
    assert there >= 2
    data = study.run(out=tmp_path / "a")
    assert data.is_complete
    _compare(data, expected)


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("dask.distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, processes=True
    ) as local:
        with distributed.Client(local) as client:
            yield local, client


def test_a_cluster_gives_the_same_table(tmp_path, cluster, study, expected):
    _, client = cluster
    result = study.run(client=client, bundle=4)
    assert result.main == expected.main and result._parts["figure"] == expected._parts["figure"]
    data = study.run(client=client, out=tmp_path / "a", bundle=5)
    here = study.run(out=tmp_path / "b", bundle=5)
    assert [p.read_bytes() for p in data.files] == [p.read_bytes() for p in here.files]


def test_a_killed_worker_costs_its_bundles_and_others_may_join(cluster, pair):
    local, client = cluster
    grid = {"mesh.half_gap": np.linspace(1e-5, 5e-5, 60), "A.mean": np.linspace(80, 110, 20)}
    study = pair.study(grid=grid, analysis="speed", collect=COLLECT)
    expected = study.run()
    pids = client.run(os.getpid)
    seen = []
    changes = []

    def change(share, words):
        seen.append(share)
        if share > 0.1 and not changes:
            os.kill(next(iter(pids.values())), signal.SIGKILL)
            changes.append("killed")
        if share > 0.3 and len(changes) == 1:
            local.scale(3)
            changes.append("added")

    from gearlash._study import _Cluster, _Memory

    store = _Memory()
    queue = _Cluster(study, client)
    interrupted = study._fill(queue, store, list(range(0, study.runs, 10)), 10, change)
    assert not interrupted and changes == ["killed", "added"]
    assert gl.Table(store.joined(study._native.empty())) == expected.main
    assert seen[-1] == 1.0


def test_mistakes_on_workers_come_back(cluster, study):
    _, client = cluster
    from gearlash._study import _bundle

    order = (study.model.to_dict(), study.model.name, study.name, "0.0.0")
    with pytest.raises(gl.GearlashError, match="install the same version"):
        client.submit(_bundle, order, 0, 1).result()


def test_ctrl_c_keeps_finished_bundles(tmp_path, cluster, study, expected):
    _, client = cluster
    main = threading.get_ident()

    def interrupt():
        signal.pthread_kill(main, signal.SIGINT)

    timer = threading.Timer(0.05, interrupt)
    timer.start()
    try:
        data = study.run(client=client, out=tmp_path / "a", bundle=1)
    except KeyboardInterrupt:
        pytest.skip("the signal came before the first bundle was asked for")
    finally:
        timer.cancel()
    again = study.run(client=client, out=tmp_path / "a")
    assert again.is_complete
    _compare(again, expected)
    assert data.folder == again.folder
