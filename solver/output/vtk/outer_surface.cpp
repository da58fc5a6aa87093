#include "solver/output/vtk/outer_surface.hpp"

#include <vtkCell.h>
#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkNew.h>
#include <vtkFieldData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

// VTK's own filters either leave the middles of quadratic edges out or lose which lines are edges
// of elements.

namespace amontons::vtk_module {
namespace {

/// Corners in order; middles[i] lies between corners i and i + 1, -1 where there is none.
struct Face {
    std::vector<vtkIdType> corners, middles;
    bool outside = true;
};

Face face_of(vtkCell* face)
{
    const int n = face->GetNumberOfEdges();
    const bool quadratic = face->GetNumberOfPoints() == 2 * n;
    Face f;
    for (int i = 0; i < n; ++i) {
        f.corners.push_back(face->GetPointId(i));
        f.middles.push_back(quadratic ? face->GetPointId(n + i) : -1);
    }
    return f;
}

} // namespace

Poly outer_surface(vtkUnstructuredGrid* grid)
{
    std::map<std::array<vtkIdType, 4>, Face> faces;
    for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
        const int type = grid->GetCellType(c);
        const vtkIdType points = grid->GetCells()->GetCellSize(c);
        if (!(type == VTK_TETRA && points == 4) && !(type == VTK_QUADRATIC_TETRA && points == 10) &&
            !(type == VTK_HEXAHEDRON && points == 8))
            throw std::runtime_error(
                "a .vtu file of the run holds cells that are not T4, T10 or H8");
        vtkCell* cell = grid->GetCell(c);
        for (int i = 0; i < cell->GetNumberOfFaces(); ++i) {
            Face face = face_of(cell->GetFace(i));
            std::array<vtkIdType, 4> key{-1, -1, -1, -1};
            std::copy(face.corners.begin(), face.corners.end(), key.begin());
            std::sort(key.begin(), key.end());
            const auto [at, is_new] = faces.emplace(key, std::move(face));
            if (!is_new) at->second.outside = false;
        }
    }

    vtkNew<vtkCellArray> triangles, lines;
    std::set<std::array<vtkIdType, 2>> drawn;
    const auto triangle = [&](vtkIdType a, vtkIdType b, vtkIdType c) {
        const vtkIdType ids[] = {a, b, c};
        triangles->InsertNextCell(3, ids);
    };
    for (const auto& [key, face] : faces) {
        if (!face.outside) continue;
        const auto& p = face.corners;
        const auto& m = face.middles;
        if (m[0] < 0) {
            for (std::size_t i = 2; i < p.size(); ++i)
                triangle(p[0], p[i - 1], p[i]);
        } else {
            for (std::size_t i = 0; i < p.size(); ++i)
                triangle(p[i], m[i], m[(i + p.size() - 1) % p.size()]);
            for (std::size_t i = 2; i < m.size(); ++i)
                triangle(m[0], m[i - 1], m[i]);
        }
        for (std::size_t i = 0; i < p.size(); ++i) {
            const vtkIdType a = p[i], b = p[(i + 1) % p.size()];
            if (!drawn.insert({std::min(a, b), std::max(a, b)}).second) continue;
            const vtkIdType straight[] = {a, b}, curved[] = {a, m[i], b};
            if (m[i] < 0)
                lines->InsertNextCell(2, straight);
            else
                lines->InsertNextCell(3, curved);
        }
    }
    auto surface = Poly::New();
    surface->SetPoints(grid->GetPoints());
    surface->SetPolys(triangles);
    surface->SetLines(lines);
    surface->GetPointData()->ShallowCopy(grid->GetPointData());
    surface->GetFieldData()->ShallowCopy(grid->GetFieldData());
    return surface;
}

} // namespace amontons::vtk_module
