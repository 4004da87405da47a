"""Results of analyses."""

from __future__ import annotations

import os
import warnings as _warnings
from collections.abc import Iterator, Mapping
from typing import Any

from ._errors import GearlashWarning, missing
from ._html import escape, grid
from ._table import Table


class Tables(Mapping):
    """Tables of a result by name; the main one is called ``main``."""

    def __init__(self, tables: list[Table]):
        self._tables = {table.name: table for table in tables}

    def __getitem__(self, name: str) -> Table:
        try:
            return self._tables[name or "main"]
        except KeyError:
            known = ", ".join(self._tables)
            raise KeyError(f"no table is called `{name}`; the result has {known or 'none'}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)

    def __repr__(self) -> str:
        return "\n".join(repr(table) for table in self._tables.values())


class Result:
    """Results of an analysis: tables, a figure, a summary, warnings. Values are identical to those of the program, to the bit."""

    def __init__(self, parts: dict[str, Any], interrupted: bool = False):
        self._parts = {key: value for key, value in parts.items() if key != "tables"}
        self._interrupted = interrupted
        #: Tables by name: ``main``, ``events``, ``multipliers``, ``orbits``, ...
        self.tables = Tables([table if isinstance(table, Table) else Table(table) for table in parts["tables"]])

    @property
    def name(self) -> str:
        """Name of the analysis."""
        return self._parts["name"]

    @property
    def kind(self) -> str:
        """Type of the analysis, such as ``frequency_response``."""
        return self._parts["kind"]

    @property
    def title(self) -> str:
        """Heading of the figure."""
        return self._parts["title"]

    @property
    def caption(self) -> str:
        """Caption of the figure."""
        return self._parts["caption"]

    @property
    def assumed(self) -> list[str]:
        """Parameters that the author of the model assumed."""
        return self._parts["assumed"]

    @property
    def warnings(self) -> list[str]:
        """Warnings."""
        return self._parts["warnings"]

    @property
    def ended_early(self) -> str | None:
        """Reason of an early end, with partial tables; None if complete."""
        return self._parts["ended_early"]

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the analysis."""
        return self._interrupted

    @property
    def summary(self) -> dict[str, Any]:
        """Other entries of ``NAME.json``: options, scales, branches, timings."""
        return self._parts["summary"]

    @property
    def main(self) -> Table:
        """The main table."""
        return self.tables["main"]

    @property
    def events(self) -> Table | None:
        """Table of events (folds, period doublings, grazings, ..); None if the analysis has none."""
        return self.tables.get("events")

    @property
    def orbits(self) -> Table | None:
        """Table of orbits at the marked points; None if not requested."""
        return self.tables.get("orbits")

    def to_pandas(self, table: str = "main", **options: Any) -> Any:
        """A table as a pandas DataFrame; see :meth:`Table.to_pandas`."""
        return self.tables[table].to_pandas(**options)

    def to_polars(self, table: str = "main", **options: Any) -> Any:
        """A table as a polars DataFrame without a copy; see :meth:`Table.to_polars`."""
        return self.tables[table].to_polars(**options)

    def to_xarray(self, table: str = "main", dims: list[str] | None = None, row: str = "row") -> Any:
        """A table as an xarray Dataset with units; see :meth:`Table.to_xarray`."""
        data = self.tables[table].to_xarray(dims, row)
        data.attrs.update(self._attributes())
        return data

    def to_netcdf(self, path: str | os.PathLike[str]) -> None:
        """All tables in a NetCDF-4 file: the main one at its root, the others as groups; units and title as attributes."""
        try:
            import xarray
        except ImportError:
            raise missing("xarray", "to_netcdf", "xarray") from None
        path = os.fspath(path)
        # Groups see the dimensions of their root: each has its own.
        whole = {
            "/" if name == "main" else f"/{name}": self.to_xarray(name, row="row" if name == "main" else f"{name}_row")
            for name in self.tables
        }
        if hasattr(xarray, "DataTree"):
            xarray.DataTree.from_dict(whole).to_netcdf(path)
            return
        for group, data in whole.items():
            data.to_netcdf(path, mode="w" if group == "/" else "a", group=None if group == "/" else group)

    def _attributes(self) -> dict[str, str]:
        given = {
            "title": self.title,
            "analysis": self.name,
            "type": self.kind,
            "ended_early": self.ended_early or "",
            "warnings": "\n".join(self.warnings),
        }
        return {key: value for key, value in given.items() if value}

    def plot(self, ax: Any = None, backend: str = "matplotlib") -> Any:
        """Figure of the analysis with the panels of the program: stable branches solid, unstable branches dashed, events as markers.

        ``ax``: axes of matplotlib, or a list of them, one per panel. ``backend``: ``matplotlib`` or ``plotly``. Returns the figure.
        """
        from . import _plot

        return _plot.draw(self, ax, backend)

    def _warn(self, stacklevel: int) -> None:
        for text in self.warnings:
            _warnings.warn(f"{self.name}: {text}", GearlashWarning, stacklevel=stacklevel)
        if self.ended_early:
            _warnings.warn(f"{self.name} ended early: {self.ended_early}", GearlashWarning, stacklevel=stacklevel)

    def __reduce__(self):
        parts = {**self._parts, "tables": list(self.tables.values())}
        return (Result, (parts, self._interrupted))

    def __repr__(self) -> str:
        lines = [f"<gearlash.Result {self.name!r} ({self.kind})>"]
        lines += [f"  {name}: {table.num_rows} rows of {', '.join(table.columns)}" for name, table in self.tables.items()]
        lines += [f"  ended early: {self.ended_early}"] if self.ended_early else []
        lines += [f"  warning: {text}" for text in self.warnings]
        return "\n".join(line if len(line) < 160 else line[:157] + "..." for line in lines)

    def _repr_html_(self) -> str:
        rows = [(name, table.num_rows, ", ".join(table.columns)) for name, table in self.tables.items()]
        words = [self.caption] + [f"ended early: {self.ended_early}"] * bool(self.ended_early)
        words += [f"warning: {text}" for text in self.warnings]
        said = "".join(f"<p>{escape(text)}</p>" for text in words if text)
        return f"<h4>{escape(self.title)}</h4>{grid(('table', 'rows', 'columns'), rows)}{said}"
