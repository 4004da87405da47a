"""Models as values."""

from __future__ import annotations

import os
import warnings as _warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from . import _native as _core
from ._errors import GearlashWarning, refuse
from ._html import escape, grid
from ._progress import Progress

if TYPE_CHECKING:
    from ._result import Result
    from ._study import Study


@dataclass(frozen=True)
class Number:
    """A number of a model."""

    name: str
    """Full dotted path, such as ``connections.mesh_2.element.half_gap``."""
    value: float
    """Value in SI units; nondimensional in a reduced model."""
    unit: str
    """Unit of the value, such as ``m``; empty for pure numbers."""
    range: str
    """Allowed values: ``any``, ``>= 0`` or ``> 0``."""
    is_written: bool
    """Whether the model states it; otherwise it is a default."""


class Numbers(Mapping):
    """All numbers of a model by full path; short forms such as ``mesh_2.half_gap`` find them too."""

    def __init__(self, entries: list[Number], model: Model):
        self._entries = {entry.name: entry for entry in entries}
        self._model = model

    def __getitem__(self, name: str) -> Number:
        if name in self._entries:
            return self._entries[name]
        full, value, unit, range_ = self._model._native.number(_text(name, "name of a number"))
        return self._entries.get(full, Number(full, value, unit, range_, False))

    def __contains__(self, name: object) -> bool:
        try:
            self[name]  # type: ignore[index]
        except (ValueError, TypeError):
            return False
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def to_pandas(self):
        """The numbers as a pandas DataFrame: columns name, value, unit, range, is_written."""
        import pandas

        return pandas.DataFrame([vars(entry) for entry in self._entries.values()])

    def __repr__(self) -> str:
        width = max((len(name) for name in self._entries), default=0)
        lines = (
            f"{entry.name:<{width}}  {entry.value:.6g} {entry.unit}{'' if entry.is_written else '  (default)'}"
            for entry in self._entries.values()
        )
        return "\n".join(lines) or "no numbers"

    def _repr_html_(self) -> str:
        rows = [
            (e.name, f"{e.value:.6g}", e.unit, e.range, "" if e.is_written else "default")
            for e in self._entries.values()
        ]
        return grid(("number", "value", "unit", "range", ""), rows)


class Check(dict):
    """Content of ``gearlash check --json``, as a dict; the first keys are also attributes."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    @property
    def natural_frequencies_hz(self) -> list[float] | None:
        """Natural frequencies of the elastic modes in full contact, Hz, ascending; None for reduced systems."""
        values = self["natural_frequencies_rad_s"]
        return None if values is None else [w / 6.283185307179586 for w in values]

    def __repr__(self) -> str:
        frequencies = self.natural_frequencies_hz
        unit = "Hz" if frequencies is not None else "omega/omega_c"
        shown = frequencies if frequencies is not None else self["natural_frequencies"]
        lines = [
            f"{self['name'] or 'model'}: sound",
            f"  connections           {', '.join(self['connections'])}",
            f"  relative coordinates  {', '.join(self['relative_coordinates'])}",
            f"  rigid-body modes      {self['rigid_body_modes']}",
            f"  natural frequencies   {', '.join(f'{x:.6g}' for x in shown)} {unit}",
            f"  analyses              {', '.join(self['analyses']) or 'none'}",
        ]
        lines += [f"  warning: {text}" for text in self["warnings"]]
        return "\n".join(lines)


def load(path: str | os.PathLike[str]) -> Model:
    """Model of a YAML file and of the files that it extends.

    Raises OSError when a file cannot be read, ModelError with file, line, column and path for everything wrong inside.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"found {type(path).__name__}, wanted the path of a model file")
    return Model._of(_core.Model.load(os.fspath(path)))


class Model:
    """A valid model: mechanics and analyses. It is immutable: :meth:`set` returns a changed copy.

    ``definition``: a dict with the keys of a model file, or the text of one. Values are numbers in SI units or texts with a
    unit: ``{"half_gap": "50 um"}``. Arrays and scalars of numpy count as lists and numbers.
    """

    __slots__ = ("_native",)
    _native: _core.Model

    def __init__(self, definition: Mapping[str, Any] | str):
        if isinstance(definition, str):
            if "\n" not in definition and definition.strip().endswith((".yaml", ".yml")):
                raise refuse("", f"found the name of a file, `{definition}`", "gearlash.load reads files")
            native = _core.Model.from_yaml(definition)
        elif isinstance(definition, Mapping):
            native = _core.Model.from_tree(_plain(definition))
        else:
            raise TypeError(f"found {type(definition).__name__}, wanted a dict or the text of a model file")
        self._take(native, stacklevel=3)

    @classmethod
    def _of(cls, native: _core.Model) -> Model:
        model = cls.__new__(cls)
        model._take(native, stacklevel=4)
        return model

    def _take(self, native: _core.Model, stacklevel: int | None) -> None:
        """Keeps the native model and issues its warnings with the stack level of the caller."""
        object.__setattr__(self, "_native", native)
        if stacklevel is not None:
            for text in native.warnings:
                _warnings.warn(text, GearlashWarning, stacklevel=stacklevel)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a model does not change; model.set({{...}}) returns another one (tried to set `{name}`)")

    @property
    def name(self) -> str:
        """Name of the model; default: that of its file."""
        return self._native.name

    @property
    def analyses(self) -> list[str]:
        """Names of the analyses in the order of the file."""
        return self._native.analyses

    @property
    def warnings(self) -> list[str]:
        """Warnings about the model."""
        return self._native.warnings

    @property
    def numbers(self) -> Numbers:
        """All numbers of the model with unit and range, by full path or short form."""
        return Numbers([Number(*entry) for entry in self._native.numbers()], self)

    def get(self, name: str) -> float:
        """Value of a number in SI units (nondimensional in a reduced model), by full path or short form."""
        return self._native.number(_text(name, "name of a number"))[1]

    def set(self, changes: Mapping[str, Any] | None = None, /, **more: Any) -> Model:
        """Copy of the model with other values, by full path or short form: numbers in SI units, strings with a unit, or whole parts.

        >>> wider = m.set({"mesh_1.half_gap": "60 um", "analyses.speed.harmonics": 20})

        Raises ModelError for unknown names, with the nearest known one, and for values out of range; ``m`` stays as it was.
        """
        if changes is not None and not isinstance(changes, Mapping):
            raise TypeError(f"found {type(changes).__name__}, wanted a dict of names and values")
        return Model._of(self._native.changed(_plain({**(changes or {}), **more})))

    def to_dict(self) -> dict[str, Any]:
        """Model as a dict with the keys of a model file, including analyses."""
        return self._native.tree()

    def check(self) -> Check:
        """Assembled system, static equilibrium and natural frequencies; reports errors of the analyses.

        Raises ModelError with all mistakes.
        """
        check = Check(self._native.check())
        return check

    def run(self, analysis: str, *, progress: bool | None = None) -> Result:
        """Runs an analysis by its name and returns its :class:`Result`.

        The GIL is released. Ctrl-C ends the run with what it has: ``result.ended_early`` says so and a warning is given; pressed
        twice it raises KeyboardInterrupt. ``progress``: a bar on stderr or in the notebook for runs that last; None: where somebody
        can see it.
        """
        from ._result import Result

        name = _text(analysis, "name of an analysis")
        with Progress(name, progress) as bar:
            parts, interrupted = self._native.run(name, bar.callback)
        result = Result(parts, interrupted)
        result._warn(stacklevel=3)
        return result

    def analyse(self, **settings: Any) -> Result:
        """Runs an analysis that is not in the model: its keys as in a model file, ``m.analyse(type="modes")``."""
        name = settings.pop("name", "analysis")
        return self._with_analysis(name, settings).run(name)

    def _with_analysis(self, name: str, settings: Mapping[str, Any]) -> Model:
        known = self.analyses
        change = {f"analyses.{name}": settings} if known else {"analyses": {name: settings}}
        native = self._native.changed(_plain(change))
        model = Model.__new__(Model)
        model._take(native, stacklevel=None)
        return model

    def study(
        self,
        name: str | None = None,
        *,
        grid: Mapping[str, Any] | None = None,
        list: Any = None,
        sample: Mapping[str, Any] | None = None,
        analysis: Any = None,
        collect: Mapping[str, Any] | None = None,
    ) -> Study:
        """A parameter study: many runs of an analysis, one row per run. Returns a :class:`Study`.

        ``name``: a ``parameter_study`` of the model file; or the keys of one: ``grid`` (values by name; every combination),
        ``list`` (rows of values, or a table such as a DataFrame), ``sample``, ``analysis`` (a name, or a dict with ``type``),
        ``collect`` (by column name: a dict as in the model file, or ``(column, reduce)``, or ``(table, column, reduce)``).

        >>> s = m.study(grid={"mesh_1.half_gap": np.linspace(1e-5, 1e-4, 10)}, analysis="speed",
        ...             collect={"largest": ("rms_mesh_1", "max")})
        """
        from ._study import Study, settings

        keys = {"grid": grid, "list": list, "sample": sample, "analysis": analysis, "collect": collect}
        given = {key: value for key, value in keys.items() if value is not None}
        if name is not None and not given:
            return Study(self, _text(name, "name of a parameter study"))
        name = "study" if name is None else _text(name, "name of the study")
        return Study(self._with_analysis(name, settings(given)), name)

    def __reduce__(self):
        return (_restored, (self.to_dict(), self.name))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Model):
            return NotImplemented
        return self.name == other.name and self.to_dict() == other.to_dict()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        tree = self.to_dict()
        parts = [
            f"{len(tree[key])} {key}" for key in ("bodies", "connections", "analyses") if isinstance(tree.get(key), dict)
        ]
        return f"<gearlash.Model {self.name!r}: {', '.join(parts) or 'reduced system'}>"

    def _repr_html_(self) -> str:
        analyses = self.to_dict().get("analyses") or {}
        rows = [(name, entry.get("type", ""), entry.get("title", "")) for name, entry in analyses.items()]
        listed = grid(("analysis", "type", "title"), rows) if rows else ""
        return f"<h4>{escape(self.name or 'model')}</h4>{self.numbers._repr_html_()}{listed}"


def _restored(tree: dict[str, Any], name: str) -> Model:
    model = Model.__new__(Model)
    model._take(_core.Model.from_tree(tree, name), stacklevel=None)
    return model


def _plain(tree: Any) -> Any:
    """Mappings of all kinds as dicts; other values are checked by the reader."""
    if isinstance(tree, Mapping):
        return {key: _plain(value) if isinstance(value, Mapping) else value for key, value in tree.items()}
    return tree


def _text(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"found {type(value).__name__}, wanted a text: the {what}")
    return value
