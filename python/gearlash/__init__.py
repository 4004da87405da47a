"""Nonlinear dynamics of torsional systems with clearances: gear trains that rattle.

    import gearlash as gl

    m = gl.load("idle.yaml").set({"mesh_1.half_gap": "60 um"})
    r = m.run("speed")
    r.plot()

A model is a value: :meth:`Model.set` returns a changed copy. Numbers without a unit are SI. The keys of a model are those of the
model file (``docs/manual.md``), results are identical to those of the program, to the bit.
"""

from __future__ import annotations

import os as _os

from . import _native
from ._errors import Diagnostic, GearlashError, GearlashWarning, ModelError
from ._law import law
from ._model import Check, Model, Number, Numbers, load
from ._result import Result
from ._study import Study
from ._table import Table

__version__: str = _native.version

__all__ = [
    "Check",
    "Diagnostic",
    "GearlashError",
    "GearlashWarning",
    "Model",
    "ModelError",
    "Number",
    "Numbers",
    "Result",
    "Study",
    "Table",
    "convert",
    "law",
    "load",
]

if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_native.forked)


def __getattr__(name: str):
    # Loaded when it is used: importing the package stays quick.
    if name == "convert":
        import importlib

        return importlib.import_module("gearlash.convert")
    raise AttributeError(f"module 'gearlash' has no attribute {name!r}")
