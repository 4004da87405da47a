"""Models from files and objects of other programs.

Torsion alone is taken over: inertias, torsional stiffness and damping of shafts, gear meshes. Shafts with mass put half of it on
each end. What has no place in a model of gearlash is named in a warning.
"""

from __future__ import annotations

import json
import math
import os
import re
import warnings as _warnings
from collections.abc import Iterator, Mapping
from typing import Any

from ._errors import GearlashWarning, refuse
from ._model import Model

MILLIMETRE = 1e-3
# Defaults of openTorsion: Pa and kg/m^3.
SHEAR_MODULUS = 80e9
DENSITY = 8000.0
PRESSURE_ANGLE = math.radians(20)

__all__ = ["opentorsion", "ross"]


class _Train:
    """A train under construction: nodes with inertia, shafts and meshes between them."""

    def __init__(self, name: str):
        self.name = name
        self.inertia: dict[Any, float] = {}
        self.labels: dict[Any, str] = {}
        self.connections: dict[str, dict[str, Any]] = {}
        self.dropped: list[str] = []

    def mass(self, node: Any, inertia: float, label: str | None = None) -> None:
        self.inertia[node] = self.inertia.get(node, 0.0) + inertia
        if label:
            self.labels.setdefault(node, label)

    def _new(self, wanted: str, taken: Any) -> str:
        name = re.sub(r"[^a-z0-9]+", "_", wanted.lower()).strip("_") or "part"
        name = f"part_{name}" if name[0].isdigit() else name
        count, found = 1, name
        while found in taken:
            count += 1
            found = f"{name}_{count}"
        return found

    def connect(self, label: str, entry: dict[str, Any]) -> None:
        self.connections[self._new(label, self.connections)] = entry

    def model(self) -> Model:
        names: dict[Any, str] = {}
        for node in self.inertia:
            names[node] = self._new(self.labels.get(node, f"node_{node}"), names.values())
        for node, inertia in self.inertia.items():
            if not inertia > 0:
                help = "give it a disk, or join the shafts on both sides to one"
                raise refuse(f"bodies.{names[node]}", f"inertia = {inertia}: must be > 0", help)
        connections = {}
        for label, entry in self.connections.items():
            own = dict(entry)
            if "shaft" in own:
                own["shaft"] = [names[node] for node in own["shaft"]]
            else:
                own["gear"] = {names[node]: radius for node, radius in own["gear"].items()}
            connections[label] = own
        for text in dict.fromkeys(self.dropped):
            _warnings.warn(text, GearlashWarning, stacklevel=4)
        bodies = {names[node]: {"inertia": inertia} for node, inertia in self.inertia.items()}
        tree: dict[str, Any] = {"bodies": bodies, "connections": connections, "report": {"units": "si"}}
        tree["analyses"] = {"modes": {"type": "modes"}}
        return Model({"name": self.name, **tree} if self.name else tree)

    def shaft(self, label: str, left: Any, right: Any, stiffness: float, damping: float) -> None:
        entry: dict[str, Any] = {"shaft": (left, right), "stiffness": stiffness}
        if damping:
            entry["damping"] = damping
        self.connect(label, entry)

    def mesh(self, label: str, radii: dict[Any, float], stiffness: float, half_gap: float) -> None:
        entry: dict[str, Any] = {"gear": radii, "stiffness": stiffness}
        if half_gap:
            entry["element"] = {"type": "backlash", "half_gap": half_gap}
        self.connect(label, entry)


def opentorsion(
    source: str | os.PathLike[str] | Mapping[str, Any],
    mesh_stiffness: float | None = None,
    half_gap: float = 0.0,
    module: float = 1e-3,
) -> Model:
    """The model of an openTorsion system: a JSON or ``.tors`` file of its editor, or the result of ``json.load``.

    openTorsion's gears are rigid; ``mesh_stiffness`` (N/m, along the line of action) takes the place of that constraint, ``half_gap``
    (m) adds backlash. Gears with tooth numbers need the ``module`` (m). Lengths and diameters in the file are in mm. Damping of disks
    against the ground and excitations are left out, with a warning.
    """
    if isinstance(source, Mapping):
        system: Any = source
    elif isinstance(source, (str, os.PathLike)):
        with open(source, encoding="utf-8") as file:
            try:
                system = json.load(file)
            except json.JSONDecodeError as error:
                raise refuse("", f"{file.name}:{error.lineno}:{error.colno}: {error.msg}") from None
    else:
        raise TypeError(f"found {type(source).__name__}, wanted the path of a JSON file or a dict")
    if not isinstance(system, Mapping):
        raise refuse("", f"found {type(system).__name__}, wanted an object with `components` and `structure`")
    reader = _OpenTorsion(system, mesh_stiffness, half_gap, module)
    return reader.read()


class _OpenTorsion:
    def __init__(self, source: Mapping[str, Any], mesh_stiffness: float | None, half_gap: float, module: float):
        components = _list(source, "components", "")
        self.components = {_text(c, "name", f"components.{k}"): c for k, c in enumerate(components)}
        self.links: dict[str, list[str]] = {}
        self.inner: set[str] = set()
        for k, pair in enumerate(_list(source, "structure", "")):
            if not (isinstance(pair, (list, tuple)) and len(pair) == 2 and all(isinstance(end, str) for end in pair)):
                raise refuse(f"structure.{k}", f"found {pair!r}, wanted two texts COMPONENT.ELEMENT")
            start, end = pair
            component = end.split(".")[0]
            if component not in self.components:
                raise refuse(f"structure.{k}", f"no component is called `{component}`")
            self.links.setdefault(start, []).append(component)
            self.inner.add(component)
        self.train = _Train(str(source.get("name", "")))
        self.mesh_stiffness, self.half_gap, self.module = mesh_stiffness, half_gap, module
        self.gears: dict[str, tuple[int, float]] = {}
        self.nodes = 0
        self.seen: set[str] = set()

    def read(self) -> Model:
        starts = [name for name in self.components if name not in self.inner]
        if len(starts) != 1:
            found = ", ".join(starts) or "none"
            raise refuse("structure", f"components without anything before them: {found}; wanted one")
        self.part(starts[0], 0)
        left_out = [name for name in self.components if name not in self.seen]
        if left_out:
            raise refuse("structure", f"components that hang together with nothing: {', '.join(left_out)}")
        return self.train.model()

    def part(self, name: str, node: int) -> None:
        """Reads a component that begins at a node; elements follow one another, shafts and driven gears lead to another node."""
        if name in self.seen:
            raise refuse("structure", f"`{name}` is reached twice")
        self.seen.add(name)
        component = self.components[name]
        path = f"components.{name}"
        for element in _list(component, "elements", path):
            own = f"{name}.{_text(element, 'name', path)}"
            node = self.element(name, own, element, node)
            for following in self.links.get(own, []):
                self.part(following, node)

    def element(self, component: str, own: str, element: Mapping[str, Any], node: int) -> int:
        kind = element.get("type")
        number = lambda key, default=None: _number(element, key, own, default)
        if "excitation" in element:
            self.train.dropped.append("excitations are left out: give `loads`")
        if kind == "Disk":
            self.train.mass(node, number("inertia"), own)
            if number("damping", 0.0):
                self.train.dropped.append(f"{own}: damping against the ground is left out")
            return node
        if kind == "ShaftDiscrete":
            return self.shaft(own, node, number("stiffness"), number("damping", 0.0), number("inertia", 0.0))
        if kind == "ShaftContinuous":
            length = number("length") * MILLIMETRE
            inner, outer = number("innerDiameter", 0.0) * MILLIMETRE, number("outerDiameter") * MILLIMETRE
            polar = math.pi * (outer**4 - inner**4) / 32
            inertia = number("density", DENSITY) * polar * length
            stiffness = number("shearModulus", SHEAR_MODULUS) * polar / length
            return self.shaft(own, node, stiffness, number("damping", 0.0), inertia)
        if kind == "GearElement":
            return self.gear(component, own, element, node)
        raise refuse(own, f"type = {kind!r}: must be Disk, ShaftDiscrete, ShaftContinuous or GearElement")

    def shaft(self, own: str, node: int, stiffness: float, damping: float, inertia: float) -> int:
        self.nodes += 1
        following = self.nodes
        self.train.mass(node, inertia / 2)
        self.train.mass(following, inertia / 2)
        self.train.shaft(own, node, following, stiffness, damping)
        return following

    def gear(self, component: str, own: str, element: Mapping[str, Any], node: int) -> int:
        inertia = _number(element, "inertia", own)
        if "teeth" in element:
            radius = _number(element, "teeth", own) * self.module / 2 * math.cos(PRESSURE_ANGLE)
        else:
            radius = _number(element, "diameter", own) * MILLIMETRE / 2
        parent = self.gears.get(f"{component}.{element['parent']}") if element.get("parent") else None
        if parent is not None:
            if self.mesh_stiffness is None:
                raise refuse(own, "openTorsion's gears are rigid", "give mesh_stiffness in N/m")
            self.nodes += 1
            node = self.nodes
            self.train.mass(node, 0.0)
            self.train.mesh(f"mesh_{own}", {parent[0]: parent[1], node: radius}, self.mesh_stiffness, self.half_gap)
        self.train.mass(node, inertia, own)
        self.gears[own] = (node, radius)
        return node


def ross(rotor: Any, mesh_stiffness: float | None = None, half_gap: float = 0.0) -> Model:
    """The torsional part of a ``ross.MultiRotor`` (nested ones too), or of a single ``ross.Rotor``: shafts, disks and gears.

    Mesh stiffness is that of the object (N/m, along the line of action) unless ``mesh_stiffness`` is given; ``half_gap`` (m) adds
    backlash. Bearings, masses and bending are left out.
    """
    if not hasattr(rotor, "shaft_elements") or not hasattr(rotor, "disk_elements"):
        raise TypeError(f"found {type(rotor).__name__}, wanted a ross.Rotor or ross.MultiRotor")
    train = _Train(str(getattr(rotor, "tag", None) or ""))
    for shaft in rotor.shaft_elements:
        stiffness, left, right = _ross_shaft(shaft)
        start = int(shaft.n)
        end = int(getattr(shaft, "n_r", start + 1))
        train.mass(start, left)
        train.mass(end, right)
        train.shaft(f"shaft_{start}_{end}", start, end, stiffness, 0.0)
    for disk in rotor.disk_elements:
        train.mass(int(disk.n), float(disk.Ip), getattr(disk, "tag", None))
    for first, second, shift, stiffness in _ross_meshes(rotor, 0):
        radii = {int(gear.n) + shift: _base_radius(gear) for gear in (first, second)}
        train.mesh("mesh", radii, stiffness if mesh_stiffness is None else mesh_stiffness, half_gap)
    if getattr(rotor, "bearing_elements", None):
        train.dropped.append("bearings are left out: they do not act on torsion")
    return train.model()


def _ross_shaft(shaft: Any) -> tuple[float, float, float]:
    """Torsional stiffness of a straight or tapered shaft, N m/rad, and the inertia of its two ends, kg m^2."""
    points, weights = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15)), (5 / 18, 8 / 18, 5 / 18)
    pieces = 32
    flexibility = left = right = 0.0
    for piece in range(pieces):
        for point, weight in zip(points, weights):
            s = (piece + point) / pieces
            outer = shaft.odl + (getattr(shaft, "odr", shaft.odl) - shaft.odl) * s
            inner = shaft.idl + (getattr(shaft, "idr", shaft.idl) - shaft.idl) * s
            polar = math.pi * (outer**4 - inner**4) / 32
            share = weight / pieces * float(shaft.L)
            flexibility += share / (float(shaft.material.G_s) * polar)
            mass = share * float(shaft.material.rho) * polar
            left += mass * (1 - s)
            right += mass * s
    return 1 / flexibility, left, right


def _base_radius(gear: Any) -> float:
    """Lever of the mesh force in the plane of rotation; ROSS's mesh acts along the normal of helical teeth."""
    helix = math.cos(float(getattr(gear, "helix_angle", 0.0) or 0.0))
    if hasattr(gear, "base_radius"):
        return float(gear.base_radius) * helix
    return float(gear.pitch_diameter) / 2 * math.cos(float(gear.pressure_angle)) * helix


def _ross_meshes(rotor: Any, shift: int) -> Iterator[tuple[Any, Any, int, float]]:
    """Pairs of gears with the shift of their nodes."""
    if hasattr(rotor, "mesh"):
        # From 2.0 on.
        mesh, nodes = rotor.mesh, rotor.driven_nodes
        first, second, stiffness = mesh.driving_gear, mesh.driven_gear, mesh.stiffness
        driving, driven = rotor.rotors["driving"], rotor.rotors["driven"]
    elif hasattr(rotor, "gears"):
        nodes, stiffness = rotor.R2_nodes, rotor.gear_mesh_stiffness
        (first, second), (driving, driven) = rotor.gears, rotor.rotors
    else:
        return
    yield first, second, shift, float(stiffness)
    yield from _ross_meshes(driving, shift)
    yield from _ross_meshes(driven, shift + int(nodes[0]) - int(driven.nodes[0]))


def _list(source: Mapping[str, Any], key: str, path: str) -> list[Any]:
    value = source.get(key)
    if not isinstance(value, list):
        raise refuse(f"{path}.{key}".strip("."), f"found {type(value).__name__}, wanted a list")
    return value


def _text(source: Any, key: str, path: str) -> str:
    value = source.get(key) if isinstance(source, Mapping) else None
    if not isinstance(value, str):
        raise refuse(f"{path}.{key}", f"found {value!r}, wanted a text")
    return value


def _number(source: Mapping[str, Any], key: str, path: str, default: float | None = None) -> float:
    value = source.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise refuse(f"{path}.{key}", f"found {value!r}, wanted a finite number")
    return float(value)
