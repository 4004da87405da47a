"""The package in a process: import time, leaks, threads, forks."""

import gc
import multiprocessing
import resource
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import gearlash as gl
from conftest import MODELS, PAIR


def test_import_is_quick():
    script = "import time; t = time.perf_counter(); import gearlash; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", script])) for _ in range(5)]
    assert min(times) < 0.2, times


def test_import_takes_no_other_package_along():
    script = "import sys, gearlash; print([m for m in ('numpy', 'pandas', 'pyarrow', 'matplotlib', 'dask') if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", script], text=True).strip() == "[]"


def _resident() -> float:
    """Megabytes."""
    with open("/proc/self/statm") as text:
        return int(text.read().split()[1]) * resource.getpagesize() / 1e6


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_ten_thousand_models_leave_nothing_behind(pair):
    def make(count):
        for k in range(count):
            model = pair.set({"mesh.half_gap": 1e-5 + k * 1e-9})
            model.get("mesh.half_gap")
            if k % 100 == 0:
                table = model.run("modes").main
                table[table.columns[0]].sum()
            try:
                pair.set({"mesh.half_gab": 1})
            except gl.ModelError:
                pass

    make(1000)
    gc.collect()
    before = _resident()
    make(10_000)
    gc.collect()
    assert _resident() - before < 8, (before, _resident())


def test_eight_threads_at_once(pair):
    expected = pair.run("speed").main
    found, errors = [], []

    def work():
        try:
            for _ in range(3):
                found.append(pair.set({"A.mean": 100}).run("speed").main)
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors and len(found) == 24
    assert all(table == expected for table in found)


def test_other_threads_go_on_while_a_run_lasts():
    model = gl.load(MODELS / "reverse_idler.yaml")
    ticks = []
    ended = threading.Event()

    def tick():
        while not ended.wait(0.005):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.monotonic()
    model.run("fig_11")
    lasted = time.monotonic() - begun
    ended.set()
    thread.join()
    gaps = np.diff(ticks)
    assert len(ticks) > 0.1 * lasted / 0.005 and (len(gaps) == 0 or gaps.max() < max(0.5, 0.5 * lasted))


def _run(_):
    return gl.Model(PAIR).run("grid").main


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_forked_processes_run_analyses():
    expected = _run(0)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        found = pool.map_async(_run, range(4)).get(timeout=60)
    assert all(table == expected for table in found)


def test_large_tables_reach_arrow_without_a_copy():
    """10^7 rows: pyarrow and polars read them where they are, pandas copies them once."""
    script = """
import numpy, resource, pandas, polars, pyarrow, gearlash as gl
def now():
    with open("/proc/self/statm") as text: return int(text.read().split()[1]) * resource.getpagesize() / 2**20
data = numpy.arange(10**7, dtype=float).tobytes()
table = gl.Table(gl._native.Table.of("t", [("x", "m", "float", data), ("y", "m", "float", data)]))
del data
before = now(); arrow = pyarrow.table(table); a = now() - before
before = now(); frame = polars.DataFrame(table); b = now() - before
before = now(); copied = table.to_pandas(); c = now() - before
print(a, b, c, float(frame["x"].sum()), float(copied["y"].sum()), arrow.num_rows)
"""
    out = subprocess.check_output([sys.executable, "-c", script], text=True).split()
    arrow, frame, copied = map(float, out[:3])
    size = 2 * 10**7 * 8 / 2**20
    assert arrow < 0.1 * size and frame < 0.1 * size, out
    assert copied < 1.2 * size, out
    assert float(out[3]) == float(out[4]) == (10**7 - 1) * 10**7 / 2
