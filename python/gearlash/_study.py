"""Parameter studies: on the threads of this machine, or on the workers of a Dask cluster."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, overload

from . import _native
from ._errors import GearlashError, missing, refuse
from ._progress import Progress
from ._result import Result
from ._table import Table

# Aims of a bundle: long enough to hide its way to a worker, short enough to be lost. Seconds as estimated for the most expensive run,
# which is mostly some twenty times what runs take.
SECONDS_PER_BUNDLE = 20.0
MOST_PER_BUNDLE = 512
FEWEST_BUNDLES = 64
# A shorter bundle is not worth its way, as long as there are still enough of them for a few workers.
LEAST_SECONDS = 2.0
FEW_BUNDLES = 16
# Bundles waiting per thread of the cluster, beyond the one that runs.
WAITING = 2
# Times that a bundle may take its worker with it.
TRIES = 4


def settings(given: dict[str, Any]) -> dict[str, Any]:
    """The keys of a parameter study as in a model file."""
    if "analysis" not in given:
        raise refuse("analysis", "missing", "the name of an analysis of the model, or a dict with `type`")
    if "collect" not in given:
        raise refuse("collect", "missing", "such as collect={'largest': ('rms.mesh_1', 'max')}")
    study: dict[str, Any] = {"type": "parameter_study"}
    for key in ("grid", "sample"):
        if key in given:
            study[key] = _mapping(key, given[key])
    if "list" in given:
        study["list"] = _records(given["list"])
    study["analysis"] = given["analysis"]
    collect = _mapping("collect", given["collect"])
    study["collect"] = {name: _collected(name, entry) for name, entry in collect.items()}
    return study


def _mapping(key: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise refuse(key, f"found {type(value).__name__}, wanted a dict")
    return dict(value)


def _records(rows: Any) -> Any:
    """Rows of values: a list of dicts, a DataFrame of pandas or polars, or a dict of columns."""
    if hasattr(rows, "to_dicts"):
        return rows.to_dicts()
    if hasattr(rows, "to_dict"):
        return rows.to_dict("records")
    if isinstance(rows, Mapping):
        columns = {name: list(values) for name, values in rows.items()}
        if len({len(values) for values in columns.values()}) > 1:
            lengths = ", ".join(f"{name}: {len(values)}" for name, values in columns.items())
            raise refuse("list", f"columns of different lengths ({lengths})")
        return [dict(zip(columns, row)) for row in zip(*columns.values())]
    return rows


def _collected(name: str, entry: Any) -> Any:
    if isinstance(entry, tuple):
        if len(entry) == 2:
            return {"column": entry[0], "reduce": entry[1]}
        if len(entry) == 3:
            return {"table": entry[0], "column": entry[1], "reduce": entry[2]}
        raise refuse(f"collect.{name}", f"found {len(entry)} parts, wanted (column, reduce) or (table, column, reduce)")
    return entry


class Study:
    """A parameter study of a model, checked: many runs of an analysis, one row of a table per run.

    Every row is a function of its number: threads, processes and clusters give the same table, bit for bit.
    """

    def __init__(self, model: Any, name: str):
        self.model = model
        self.name = name
        self._native = model._native.study(name)

    @property
    def runs(self) -> int:
        """Number of runs."""
        return self._native.runs

    @property
    def columns(self) -> list[str]:
        """Columns of the table: ``run``, the parameters, the collected quantities, ``status``, ``reason``, ``warnings``."""
        return self._native.empty().columns

    def rows(self, start: int, stop: int) -> Table:
        """The rows of runs ``start`` to ``stop - 1``, computed on this thread without the GIL."""
        return Table(self._native.rows(start, stop))

    @overload
    def run(
        self, client: Any = ..., *, out: None = ..., bundle: int | None = ..., jobs: int | None = ..., progress: bool | None = ...
    ) -> Result: ...

    @overload
    def run(
        self,
        client: Any = ...,
        *,
        out: str | os.PathLike[str],
        bundle: int | None = ...,
        jobs: int | None = ...,
        progress: bool | None = ...,
    ) -> DataSet: ...

    def run(
        self,
        client: Any = None,
        *,
        out: str | os.PathLike[str] | None = None,
        bundle: int | None = None,
        jobs: int | None = None,
        progress: bool | None = None,
    ) -> Any:
        """Runs everything that is not finished. Returns a :class:`Result`, or a :class:`DataSet` if ``out`` is given.

        ``client``: a ``dask.distributed.Client``; its workers need this package. Bundles of runs come from one queue, workers may
        come and go, one that is lost costs its unfinished bundles. ``out``: folder of a Parquet data set that the rows go to as they
        arrive; called again with the same folder, a study goes on where it was. ``bundle``: runs per bundle. ``jobs``: threads of
        this machine. Ctrl-C ends the study with what it has.
        """
        if client is None and out is None and jobs is None and bundle is None:
            return self.model.run(self.name, progress=progress)
        for key, value in (("bundle", bundle), ("jobs", jobs)):
            if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
                raise ValueError(f"{key} = {value!r}: must be a whole number >= 1")
        store: Any = _Memory() if out is None else DataSet._open(self, Path(out), bundle)
        size = store.bundle or bundle or self._bundle()
        starts = [start for start in range(0, self.runs, size) if start not in store]
        queue = _Threads(self, jobs) if client is None else _Cluster(self, client)
        with Progress(self.name, progress) as bar:
            interrupted = self._fill(queue, store, starts, size, bar.callback)
        if out is not None:
            store.interrupted = interrupted
            return store
        rows = store.joined(self._native.empty())
        result = Result(self._native.report(rows), interrupted)
        result._warn(stacklevel=3)
        return result

    def _fill(self, queue: Any, store: Any, starts: list[int], size: int, tell: Callable | None) -> bool:
        """Takes bundles from the queue into the store; whether Ctrl-C ended it."""
        spans = ((start, min(start + size, self.runs)) for start in starts)
        left = sum(min(start + size, self.runs) - start for start in starts)
        done = self.runs - left
        try:
            for start, stop, rows in queue.work(spans):
                store.put(start, rows)
                done += stop - start
                if tell:
                    tell(done / max(self.runs, 1), f"{done} of {self.runs} runs")
        except KeyboardInterrupt:
            for start, stop, rows in queue.end():
                store.put(start, rows)
            return True
        return False

    def _bundle(self) -> int:
        """Runs per bundle; a function of the study alone, so that every cluster makes the same files."""
        seconds = max(self._native.seconds, 1e-6)
        by_time = int(SECONDS_PER_BUNDLE / seconds)
        worth = min(int(LEAST_SECONDS / seconds), -(-self.runs // FEW_BUNDLES))
        by_number = max(-(-self.runs // FEWEST_BUNDLES), worth)
        return max(1, min(by_time, by_number, MOST_PER_BUNDLE))

    def __reduce__(self):
        return (Study, (self.model, self.name))

    def __repr__(self) -> str:
        return f"<gearlash.Study {self.name!r} of {self.model.name!r}: {self.runs} runs; {', '.join(self.columns)}>"


class _Memory:
    """Rows of bundles in memory."""

    bundle = None

    def __init__(self) -> None:
        self._parts: dict[int, _native.Table] = {}

    def __contains__(self, start: int) -> bool:
        return start in self._parts

    def put(self, start: int, rows: Table) -> None:
        self._parts[start] = rows._native

    def joined(self, empty: _native.Table) -> _native.Table:
        return _native.Table.joined([empty, *(self._parts[start] for start in sorted(self._parts))])


class DataSet:
    """A study as a Parquet data set: ``part-*.parquet`` in the order of the runs, and ``study.json``.

    Everybody can open it: ``polars.scan_parquet(folder / "*.parquet")``, ``duckdb``, ``pyarrow.dataset``.
    """

    def __init__(self, folder: Path, record: dict[str, Any]):
        #: Folder of the files.
        self.folder = folder
        #: Number of runs of the study.
        self.runs: int = record["runs"]
        #: Whether Ctrl-C ended the last call.
        self.interrupted = False
        self.bundle: int = record["bundle"]
        self._record = record

    @classmethod
    def _open(cls, study: Study, folder: Path, bundle: int | None) -> DataSet:
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise missing("pyarrow", "run(out=...)", "dask") from None
        own = {"study": study.name, "identity": study._native.identity, "version": _native.version, "runs": study.runs}
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "study.json"
        if not path.exists():
            record = {**own, "bundle": bundle or study._bundle()}
            _write(path, lambda temporary: Path(temporary).write_text(json.dumps(record, indent=2) + "\n"))
            return cls(folder, record)
        record = json.loads(path.read_text())
        differing = [key for key, value in own.items() if record.get(key) != value]
        if differing:
            message = f"{folder} holds another study (differs in {', '.join(differing)})"
            raise refuse("out", message, "choose another folder")
        if bundle is not None and bundle != record["bundle"]:
            message = f"bundle = {bundle}, but {folder} was begun with {record['bundle']}"
            raise refuse("bundle", message, "leave it out to go on")
        return cls(folder, record)

    def _file(self, start: int) -> Path:
        return self.folder / f"part-{start:012d}.parquet"

    def __contains__(self, start: int) -> bool:
        return self._file(start).exists()

    def put(self, start: int, rows: Table) -> None:
        """Writes a bundle atomically."""
        import pyarrow
        import pyarrow.parquet

        _write(self._file(start), lambda temporary: pyarrow.parquet.write_table(pyarrow.table(rows), temporary))

    @property
    def files(self) -> list[Path]:
        """Files in the order of the runs."""
        return sorted(self.folder.glob("part-*.parquet"))

    @property
    def finished(self) -> int:
        """Runs in the files."""
        starts = (int(path.stem.removeprefix("part-")) for path in self.files)
        return sum(min(self.bundle, self.runs - start) for start in starts)

    @property
    def is_complete(self) -> bool:
        """Whether all runs are present."""
        return self.finished == self.runs

    def to_arrow(self) -> Any:
        """All rows as a pyarrow Table, in the order of the runs."""
        import pyarrow
        import pyarrow.parquet

        return pyarrow.concat_tables(pyarrow.parquet.read_table(path, partitioning=None) for path in self.files)

    def to_pandas(self) -> Any:
        """All rows as a pandas DataFrame, in the order of the runs."""
        return self.to_arrow().to_pandas()

    def to_polars(self) -> Any:
        """All rows as a polars DataFrame, in the order of the runs."""
        import polars

        return polars.read_parquet(self.files)

    def __repr__(self) -> str:
        return f"<gearlash.DataSet {str(self.folder)!r}: {self.finished} of {self.runs} runs in {len(self.files)} files>"


def _write(path: Path, fill: Callable[[str], Any]) -> None:
    """Writes under a temporary name in the same folder, then renames."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".tmp")
    os.close(handle)
    try:
        fill(temporary)
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


Span = tuple[int, int]


class _Threads:
    """Bundles on the threads of this machine."""

    def __init__(self, study: Study, jobs: int | None):
        self._study = study
        self._jobs = jobs or os.cpu_count() or 1
        self._flag = _native.Interrupt()
        self._running: dict[Future, Span] = {}
        self._pool: ThreadPoolExecutor | None = None

    def work(self, spans: Iterator[Span]) -> Iterator[tuple[int, int, Table]]:
        native = self._study._native
        self._pool = ThreadPoolExecutor(self._jobs)
        try:
            while True:
                while len(self._running) < self._jobs + WAITING and (span := next(spans, None)):
                    self._running[self._pool.submit(native.rows, span[0], span[1], self._flag)] = span
                if not self._running:
                    return
                for future in wait(self._running, return_when=FIRST_COMPLETED).done:
                    rows = Table(future.result())
                    yield (*self._running.pop(future), rows)
        finally:
            self._flag.request()
            self._pool.shutdown(wait=False, cancel_futures=True)

    def end(self) -> Iterator[tuple[int, int, Table]]:
        """Bundles that were in progress."""
        self._flag.request()
        for future, (start, stop) in self._running.items():
            if not future.cancel() and (rows := Table(future.result())).num_rows == stop - start:
                yield start, stop, rows


class _Cluster:
    """Bundles on the workers of a Dask cluster."""

    def __init__(self, study: Study, client: Any):
        self._study = study
        self._client = client
        self._spans: dict[Any, Span] = {}
        self._tries: dict[Span, int] = {}

    def work(self, spans: Iterator[Span]) -> Iterator[tuple[int, int, Table]]:
        try:
            from dask.distributed import KilledWorker, as_completed
        except ImportError:
            raise missing("dask[distributed]", "run(client=...)", "dask") from None
        client, study = self._client, self._study
        if not hasattr(client, "submit"):
            raise TypeError(f"client: found {type(client).__name__}, wanted a dask.distributed.Client")
        # A task, no scattered data: the scheduler makes it again when the worker that has it is lost.
        order = (study.model.to_dict(), study.model.name, study.name, _native.version)
        key = f"gearlash-{study._native.identity[:16]}-{os.urandom(4).hex()}"
        shared = client.submit(_same, order, key=key)
        completed = as_completed()

        def submit(span: Span) -> None:
            future = client.submit(_bundle, shared, *span, key=f"{key}-{span[0]}-{self._tries.get(span, 0)}", retries=0)
            self._spans[future] = span
            completed.add(future)

        def fill() -> None:
            threads = max(1, sum(client.nthreads().values()))
            while len(self._spans) < threads * (1 + WAITING) and (span := next(spans, None)):
                submit(span)

        fill()
        while self._spans:
            future = next(completed)
            span = self._spans.pop(future)
            failure = future.exception() if future.status == "error" else None
            if isinstance(failure, KilledWorker) or future.status in ("cancelled", "lost"):
                self._tries[span] = self._tries.get(span, 0) + 1
                if self._tries[span] >= TRIES:
                    raise GearlashError(f"runs {span[0]} to {span[1] - 1} were lost with {TRIES} workers") from failure
                submit(span)
                continue
            if failure is not None:
                raise failure
            rows = future.result()
            future.release()
            fill()
            yield (*span, rows)

    def end(self) -> Iterator[tuple[int, int, Table]]:
        """Returns the requested bundles; existing bundles are kept."""
        for future, (start, stop) in self._spans.items():
            if future.status == "finished":
                yield start, stop, future.result()
        self._client.cancel(list(self._spans))


def _same(order: tuple) -> tuple:
    return order


_STUDIES: dict[str, Study] = {}


def _bundle(order: tuple, start: int, stop: int) -> Table:
    """The task of a worker; the model is read once per process."""
    from ._model import _restored

    tree, name, study, version = order
    if version != _native.version:
        raise GearlashError(f"the worker has gearlash {_native.version}, the client {version}: install the same version")
    key = repr(order)
    known = _STUDIES.get(key)
    if known is None:
        _STUDIES.clear()
        known = _STUDIES[key] = Study(_restored(tree, name), study)
    return known.rows(start, stop)
