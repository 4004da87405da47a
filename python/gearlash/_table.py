"""Tables of results."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from . import _native
from ._errors import missing
from ._html import MOST_ROWS, escape, grid

if TYPE_CHECKING:
    import numpy as np


class Table:
    """A table: named columns of equal length, each with a unit. ``table[column]`` is a numpy array.

    It has the Arrow PyCapsule interface: ``pyarrow.table(t)`` and ``polars.DataFrame(t)`` read it without a copy. Empty cells
    are null there and NaN in numpy and pandas.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _native.Table):
        self._native = native

    @property
    def name(self) -> str:
        """``main``, ``events``, ``orbits``, ..."""
        return self._native.name or "main"

    @property
    def columns(self) -> list[str]:
        """Names of the columns in the order of the file."""
        return self._native.columns

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column; empty if dimensionless."""
        return self._native.units

    @property
    def num_rows(self) -> int:
        """Number of rows."""
        return self._native.num_rows

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.num_rows, len(self.columns)

    def __getitem__(self, column: str) -> np.ndarray:
        """A column: float64, int64 (both read-only views of the result's memory) or an array of strings. Shape (rows,)."""
        import numpy

        if not isinstance(column, str):
            raise TypeError(f"found {type(column).__name__}, wanted the name of a column")
        values = self._native.values(column)
        if isinstance(values, list):
            return numpy.array(values, dtype=object)
        return numpy.asarray(values)

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        """Number of columns, as of a dict of them."""
        return len(self.columns)

    def __contains__(self, column: object) -> bool:
        return column in self.columns

    # Not a Mapping: polars would copy the columns of one before it asked for Arrow.
    def keys(self) -> list[str]:
        """Names of the columns: ``dict(table)`` is a dict of numpy arrays."""
        return self.columns

    def __eq__(self, other: object) -> bool:
        """Equal to the bit."""
        if not isinstance(other, Table):
            return NotImplemented
        return self._native.name == other._native.name and self._native.plain() == other._native.plain()

    __hash__ = None  # type: ignore[assignment]

    def __arrow_c_schema__(self) -> object:
        return self._native.__arrow_c_schema__()

    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]:
        return self._native.__arrow_c_array__(requested_schema)

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self._native.__arrow_c_stream__(requested_schema)

    def rows(self, **wanted: Any) -> Table:
        """The rows whose columns have these values: ``t.rows(kind="fold")``; ``rms.mesh_1`` as ``rows(**{"rms.mesh_1": 0})``."""
        import numpy

        keep = numpy.ones(self.num_rows, dtype=bool)
        for column, value in wanted.items():
            keep &= self[column] == value
        plain = []
        for (name, unit, kind, data), column in zip(self._native.plain(), self.columns):
            kept = self[column][keep]
            plain.append((name, unit, kind, list(kept) if kind == "text" else numpy.ascontiguousarray(kept).tobytes()))
        return Table(_native.Table.of(self._native.name, plain))

    def to_numpy(self) -> np.ndarray:
        """The columns of numbers as one array of float64, shape (rows, columns of numbers)."""
        import numpy

        numbers = [self[name] for name in self.columns if self[name].dtype != object]
        return numpy.column_stack(numbers) if numbers else numpy.empty((self.num_rows, 0))

    def to_pandas(self, attributes: bool = False) -> Any:
        """A pandas DataFrame; one copy of the numbers. Units are in ``frame.attrs["units"]``.

        ``attributes``: names that Python takes as attributes, ``rms_mesh_1`` for ``rms.mesh_1``.
        """
        try:
            import pandas
        except ImportError:
            raise missing("pandas", "to_pandas", "pandas") from None
        names = self._names(attributes)
        frame = pandas.DataFrame({names[column]: self[column] for column in self.columns})
        frame.attrs["units"] = {names[column]: unit for column, unit in self.units.items()}
        return frame

    def to_polars(self, attributes: bool = False) -> Any:
        """A polars DataFrame without a copy."""
        try:
            import polars
        except ImportError:
            raise missing("polars", "to_polars", "polars") from None
        frame = polars.DataFrame(self)
        return frame.rename(self._names(attributes)) if attributes else frame

    def to_arrow(self) -> Any:
        """A pyarrow Table without a copy; units are in the metadata of the fields."""
        try:
            import pyarrow
        except ImportError:
            raise missing("pyarrow", "to_arrow", "dask") from None
        return pyarrow.table(self)

    def to_xarray(self, dims: list[str] | None = None, row: str = "row") -> Any:
        """An xarray Dataset with units as attributes.

        ``dims``: columns that become dimensions where the rows fill a grid of them, as in a study; one dimension otherwise, whose name
        is ``row``.
        """
        try:
            import xarray
        except ImportError:
            raise missing("xarray", "to_xarray", "xarray") from None
        units = self.units

        def attributes(column: str) -> dict[str, str]:
            return {"units": units[column]} if units[column] else {}

        def values(column: str) -> np.ndarray:
            found = self[column]
            return found.astype(str) if found.dtype == object else found

        if not dims:
            variables = {column: (row, values(column), attributes(column)) for column in self.columns}
            return xarray.Dataset(variables)
        return self._on_grid(xarray, dims, values, attributes)

    def _on_grid(self, xarray: Any, dims: list[str], values: Any, attributes: Any) -> Any:
        import numpy

        axes, places = [], []
        for column in dims:
            found, place = numpy.unique(values(column), return_inverse=True)
            axes.append(found)
            places.append(place.reshape(-1))
        shape = tuple(len(axis) for axis in axes)
        where = numpy.ravel_multi_index(tuple(places), shape)
        if len(numpy.unique(where)) != self.num_rows:
            raise ValueError(f"several rows at one place of {', '.join(dims)}: they are no grid")
        variables = {}
        for column in self.columns:
            if column in dims:
                continue
            found = values(column)
            kind = _wide(found, where.size, shape)
            full = numpy.full(shape, numpy.nan if kind == numpy.float64 else numpy.zeros((), kind), dtype=kind)
            full.reshape(-1)[where] = found
            variables[column] = (dims, full, attributes(column))
        coordinates = {column: (column, axis, attributes(column)) for column, axis in zip(dims, axes)}
        return xarray.Dataset(variables, coords=coordinates)

    def _names(self, attributes: bool) -> dict[str, str]:
        """Names of the columns, converted to attribute names on request; colliding names stay distinct."""
        if not attributes:
            return {column: column for column in self.columns}
        names: dict[str, str] = {}
        for column in self.columns:
            fit = "".join(c if c.isalnum() else "_" for c in column)
            fit = f"_{fit}" if fit[:1].isdigit() else fit
            while fit in names.values():
                fit += "_"
            names[column] = fit
        return names

    def __reduce__(self):
        return (_restored, (self._native.name, self._native.plain()))

    def __repr__(self) -> str:
        units = self.units
        shown = ", ".join(f"{column} [{units[column]}]" if units[column] else column for column in self.columns)
        return f"<gearlash.Table {self.name!r}: {self.num_rows} rows; {shown}>"

    def _repr_html_(self) -> str:
        units = self.units
        head = [f"{column} [{units[column]}]" if units[column] else column for column in self.columns]
        count = min(self.num_rows, 10)
        columns = [self[column][:count] for column in self.columns]
        cells = [[f"{x:.6g}" if c.dtype.kind == "f" else x for x in c] for c in columns]
        listed = grid(head, list(zip(*cells)) if cells else [])
        more = f"<p>{self.num_rows} rows, the first {count} shown</p>" if self.num_rows > min(count, MOST_ROWS) else ""
        return f"<b>{escape(self.name)}</b>{listed}{more}"


def _wide(found: np.ndarray, filled: int, shape: tuple[int, ...]) -> Any:
    """Integer columns with gaps become float columns, because only these have a value for a gap."""
    import numpy

    is_full = filled == numpy.prod(shape)
    return found.dtype if is_full or found.dtype.kind != "i" else numpy.float64


def _restored(name: str, plain: list) -> Table:
    return Table(_native.Table.of(name, plain))
