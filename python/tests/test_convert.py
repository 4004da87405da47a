"""Models of other programs, against eigenvalues computed here from their matrices."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

import gearlash as gl
from gearlash import convert

WINDMILL = {
    "name": "windmill",
    "components": [
        {
            "name": "Windmill Rotor 1",
            "elements": [
                {"name": "Disk 1", "type": "Disk", "inertia": 3430, "damping": 1},
                {"name": "Shaft 1", "type": "ShaftDiscrete", "stiffness": 5550000000, "damping": 0},
                {"name": "Disk 2", "type": "Disk", "inertia": 95200, "damping": 0, "excitation": [[4, 0.001466]]},
            ],
        },
        {"name": "Shaft 1", "elements": [{"name": "Shaft 1", "type": "ShaftDiscrete", "damping": 0, "stiffness": 368000000}]},
        {"name": "Windmill Turbine 1", "elements": [{"name": "Disk 1", "type": "Disk", "inertia": 9200000, "damping": 0}]},
    ],
    "structure": [["Windmill Rotor 1.Disk 2", "Shaft 1.Shaft 1"], ["Shaft 1.Shaft 1", "Windmill Turbine 1.Disk 1"]],
}


def frequencies(m, k):
    """Elastic natural frequencies, rad/s."""
    inverse = np.diag(1 / np.sqrt(m))
    values = np.linalg.eigvalsh(inverse @ k @ inverse)
    return np.sqrt(values[values > 1e-9 * values.max()])


def spring(size, rows, k):
    row = np.zeros(size)
    for place, lever in rows.items():
        row[place] = lever
    return k * np.outer(row, row)


def test_opentorsion_windmill(tmp_path):
    path = tmp_path / "windmill.json"
    path.write_text(json.dumps(WINDMILL))
    with pytest.warns(gl.GearlashWarning, match="left out"):
        model = convert.opentorsion(path)
    assert model.name == "windmill" and len(model.to_dict()["bodies"]) == 3
    k = spring(3, {0: 1, 1: -1}, 5.55e9) + spring(3, {1: 1, 2: -1}, 3.68e8)
    expected = frequencies(np.array([3430, 95200, 9.2e6]), k)
    found = model.check()["natural_frequencies_rad_s"]
    assert np.allclose(found, expected, rtol=1e-12)


def test_opentorsion_gears_and_branches():
    system = {
        "name": "branch",
        "components": [
            {
                "name": "box",
                "elements": [
                    {"name": "d", "type": "Disk", "inertia": 2.0, "damping": 0},
                    {"name": "s", "type": "ShaftContinuous", "length": 400, "innerDiameter": 40, "outerDiameter": 80, "damping": 3},
                    {"name": "g1", "type": "GearElement", "inertia": 0.5, "diameter": 100},
                    {"name": "g2", "type": "GearElement", "inertia": 0.25, "diameter": 300, "parent": "g1"},
                ],
            },
            {"name": "out", "elements": [
                {"name": "s", "type": "ShaftDiscrete", "stiffness": 1e5, "damping": 0},
                {"name": "d", "type": "Disk", "inertia": 4.0, "damping": 0}]},
        ],
        "structure": [["box.g2", "out.s"]],
    }  # fmt: skip
    model = convert.opentorsion(system, mesh_stiffness=2e8, half_gap=5e-5)
    polar = math.pi * (0.08**4 - 0.04**4) / 32
    half = 8000 * polar * 0.4 / 2
    m = np.array([2 + half, 0.5 + half, 0.25, 4.0])
    k = spring(4, {0: 1, 1: -1}, 80e9 * polar / 0.4) + spring(4, {1: 0.05, 2: 0.15}, 2e8) + spring(4, {2: 1, 3: -1}, 1e5)
    assert np.allclose(model.check()["natural_frequencies_rad_s"], frequencies(m, k), rtol=1e-10)
    assert model.get("mesh_box_g2.half_gap") == 5e-5
    with pytest.raises(gl.ModelError, match="give mesh_stiffness"):
        convert.opentorsion(system)


@pytest.mark.parametrize("value", [None, 3, "none.json", {}, {"components": 3}, {"components": [1], "structure": []}])
def test_wrong_files_are_refused(value):
    with pytest.raises((gl.ModelError, TypeError, OSError)):
        convert.opentorsion(value)


def test_wrong_elements_are_named():
    for key, value in (("type", "Spring"), ("inertia", "big"), ("inertia", float("nan")), ("inertia", None)):
        broken = json.loads(json.dumps(WINDMILL))
        broken["components"][0]["elements"][0][key] = value
        with pytest.raises(gl.ModelError, match="Windmill Rotor 1.Disk 1"):
            convert.opentorsion(broken)
    broken = json.loads(json.dumps(WINDMILL))
    broken["structure"].append(["Windmill Turbine 1.Disk 1", "Windmill Rotor 1.Disk 1"])
    with pytest.raises(gl.ModelError, match="wanted one"):
        convert.opentorsion(broken)


def _ross_example():
    """The objects of `ross.MultiRotor` for the turbo-alternator of Rao, Shiau and Chang (1998), as far as torsion goes."""
    steel = SimpleNamespace(rho=7800.0, G_s=79.5e9)
    shaft = lambda n, length, d: SimpleNamespace(n=n, n_r=n + 1, L=length, idl=0.0, odl=d, idr=0.0, odr=d, material=steel)
    disk = lambda n, inertia: SimpleNamespace(n=n, Ip=inertia, tag=None)
    gear = lambda n, inertia, r: SimpleNamespace(
        n=n, Ip=inertia, tag=None, pitch_diameter=2 * r / math.cos(math.radians(22.5)), pressure_angle=math.radians(22.5)
    )
    shafts = [shaft(k, length, d) for k, (length, d) in enumerate(zip([0.1, 4.24, 1.16, 0.3], [0.3, 0.3, 0.22, 0.22]))]
    shafts += [shaft(k + 5, length, 0.15) for k, length in enumerate([0.3, 5.0, 0.1])]
    first, second = gear(4, 113.9, 0.5086), gear(5, 0.004, 0.03567)
    rotors = [SimpleNamespace(nodes=[0, 1, 2, 3, 4]), SimpleNamespace(nodes=[0, 1, 2, 3])]
    return SimpleNamespace(
        tag="turbo-alternator", shaft_elements=shafts, disk_elements=[disk(1, 32.2), disk(2, 6.23), first, second, disk(7, 0.149)],
        bearing_elements=[], rotors=rotors, gears=[first, second], gear_mesh_stiffness=1e8, R2_nodes=[5, 6, 7, 8],
    )  # fmt: skip


@pytest.mark.parametrize("version", [1, 2])
def test_ross_multi_rotor(version):
    rotor = _ross_example()
    if version == 2:
        first, second = rotor.gears
        rotor.mesh = SimpleNamespace(driving_gear=first, driven_gear=second, stiffness=rotor.gear_mesh_stiffness)
        rotor.rotors = dict(zip(("driving", "driven"), rotor.rotors))
        rotor.driven_nodes = rotor.R2_nodes
        del rotor.gears, rotor.R2_nodes, rotor.gear_mesh_stiffness
    model = convert.ross(rotor)
    size, rho, g = 9, 7800.0, 79.5e9
    m, k = np.zeros(size), np.zeros((size, size))
    for left, length, d in [(0, 0.1, 0.3), (1, 4.24, 0.3), (2, 1.16, 0.22), (3, 0.3, 0.22), (5, 0.3, 0.15), (6, 5.0, 0.15), (7, 0.1, 0.15)]:
        polar = math.pi * d**4 / 32
        m[[left, left + 1]] += rho * polar * length / 2
        k += spring(size, {left: 1, left + 1: -1}, g * polar / length)
    for node, inertia in ((1, 32.2), (2, 6.23), (4, 113.9), (5, 0.004), (7, 0.149)):
        m[node] += inertia
    k += spring(size, {4: 0.5086, 5: 0.03567}, 1e8)
    found = model.check()["natural_frequencies_rad_s"]
    assert np.allclose(found, frequencies(m, k), rtol=1e-9)
    geared = convert.ross(_ross_example(), mesh_stiffness=2e8, half_gap=1e-5)
    assert geared.get("mesh.half_gap") == 1e-5 and geared.get("mesh.stiffness") == 2e8
    with pytest.raises(TypeError, match="wanted a ross.Rotor"):
        convert.ross(3)
