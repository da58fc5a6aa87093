"""Bodies as meshes of pyvista and meshio, where these are installed; else what is missing is reported."""

import importlib.util
import sys
import types
import unittest
from unittest import mock

import numpy as np

import amontons as am
from scenes import Case, block, main, tube_and_wire


def volumes(points, cells):
    """Of hexahedra, by six tetrahedra each."""
    corners = points[cells]
    total = 0
    for a, b, c in ((1, 2, 6), (2, 3, 6), (3, 7, 6), (7, 4, 6), (4, 5, 6), (5, 1, 6)):
        edges = corners[:, [a, b, c]] - corners[:, [0]]
        total = total + np.linalg.det(edges) / 6
    return np.abs(total)


class ConvertTest(Case):
    def bodies(self):
        sim = am.Simulation(block())
        sim.step(3)
        wire = am.Simulation(tube_and_wire())
        wire.step(20)
        return sim.bodies["block"], sim.bodies["floor"], wire.bodies["tube"], wire.bodies["wire"]

    def test_what_is_missing_is_reported(self):
        with mock.patch.dict(sys.modules, {"pyvista": None, "meshio": None}):
            for body in self.bodies():
                with self.assertRaisesRegex(am.ModuleMissing, "pip install pyvista"):
                    body.to_pyvista()
                with self.assertRaisesRegex(am.ModuleMissing, "apt-get install python3-meshio") as missing:
                    body.to_meshio()
                self.assertEqual(missing.exception.name, "meshio")

    def test_meshio_is_given_points_cells_and_fields(self):
        class Mesh:  # stands for meshio's, which takes these arguments
            def __init__(self, points, cells, point_data, cell_data):
                self.points, self.cells, self.point_data, self.cell_data = points, cells, point_data, cell_data
                for values in cell_data.values():
                    assert [len(v) for v in values] == [len(c) for _, c in cells]
        fake = types.ModuleType("meshio")
        fake.Mesh = Mesh
        with mock.patch.dict(sys.modules, {"meshio": fake}):
            solid, floor, tube, wire = self.bodies()
            mesh = solid.to_meshio()
            (kind, cells), = mesh.cells
            self.assertEqual((kind, cells.shape), ("hexahedron", (8, 8)))
            np.testing.assert_array_equal(mesh.points, solid.points)
            self.assertLess(abs(volumes(mesh.points, cells).sum() / 1e-3 - 1), 0.1)  # pressed a little
            self.assertEqual(set(mesh.point_data), set(solid.fields))
            self.assertEqual(set(mesh.cell_data), set(solid.cell_fields))
            mesh.points[0] = 7  # a copy
            self.assertNotEqual(solid.points[0, 0], 7)
            (kind, triangles), = tube.to_meshio().cells
            self.assertEqual((kind, triangles.shape), ("triangle", tube.triangles.shape))
            (kind, lines), = wire.to_meshio().cells
            self.assertEqual((kind, lines.tolist()[0], len(lines)), ("line", [0, 1], len(wire) - 1))

    def test_pyvista_is_given_what_vtk_takes(self):
        class PolyData:  # stand for pyvista's: cells are their number of corners, and these
            def __init__(self, points=None, faces=None):
                self.points, self.faces, self.lines, self.point_data, self.cell_data = points, faces, None, {}, {}

        class UnstructuredGrid:
            def __init__(self, cells, kinds, points):
                self.cells, self.kinds, self.points, self.point_data, self.cell_data = cells, kinds, points, {}, {}
        fake = types.ModuleType("pyvista")
        fake.PolyData, fake.UnstructuredGrid = PolyData, UnstructuredGrid
        with mock.patch.dict(sys.modules, {"pyvista": fake}):
            solid, floor, tube, wire = self.bodies()
            grid = solid.to_pyvista()
            self.assertEqual((grid.kinds.tolist(), grid.kinds.dtype), ([12] * 8, np.uint8))  # VTK_HEXAHEDRON
            rows = grid.cells.reshape(8, 9)
            self.assertEqual(rows[:, 0].tolist(), [8] * 8)
            np.testing.assert_array_equal(rows[:, 1:], solid.cells["H8"])
            self.assertEqual((set(grid.point_data), set(grid.cell_data)), (set(solid.fields), set(solid.cell_fields)))
            faces = tube.to_pyvista().faces.reshape(-1, 4)
            self.assertTrue((faces[:, 0] == 3).all())
            np.testing.assert_array_equal(faces[:, 1:], tube.triangles)
            line = wire.to_pyvista()
            self.assertEqual(line.lines.tolist(), [len(wire), *range(len(wire))])
            np.testing.assert_array_equal(line.point_data["radius"], wire.fields["radius"])

    @unittest.skipUnless(importlib.util.find_spec("meshio"), "no meshio")
    def test_meshio_reads_its_own_file_back(self):
        import os
        import tempfile
        import meshio
        solid = self.bodies()[0]
        with tempfile.TemporaryDirectory() as path:
            file = os.path.join(path, "block.vtu")
            solid.to_meshio().write(file)
            again = meshio.read(file)
        np.testing.assert_allclose(again.points, solid.points)
        np.testing.assert_array_equal(again.cells[0].data, solid.cells["H8"])

    @unittest.skipUnless(importlib.util.find_spec("pyvista"), "no pyvista")
    def test_pyvista_recognises_volume_surface_and_line(self):
        solid, floor, tube, wire = self.bodies()
        grid = solid.to_pyvista()
        self.assertAlmostEqual(grid.volume / volumes(solid.points, solid.cells["H8"]).sum(), 1, places=6)
        self.assertEqual(set(grid.point_data.keys()), set(solid.fields))
        self.assertEqual(tube.to_pyvista().n_cells, len(tube.triangles))
        line = wire.to_pyvista()
        self.assertEqual((line.n_points, line.n_lines), (len(wire), 1))
        self.assertAlmostEqual(line.length, np.linalg.norm(np.diff(wire.points, axis=0), axis=1).sum(), places=9)
        np.testing.assert_array_equal(line.point_data["radius"], wire.fields["radius"])


if __name__ == "__main__":
    main()
