#include "solver/output/vtk/polydata.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkTriangleFilter.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <stdexcept>

namespace {

using amontons::vtk_module::read_polydata;

struct Triangles {
    double* points = nullptr;
    long point_count = 0;
    int* triangles = nullptr;
    long triangle_count = 0;
};

template <typename T> T* new_array(long count)
{
    auto* array = static_cast<T*>(std::malloc(static_cast<std::size_t>(count) * sizeof(T)));
    if (!array) throw std::bad_alloc();
    return array;
}

/// @throws std::runtime_error  stating what is wrong with the file
Triangles read_triangles(const char* path)
{
    std::string error;
    const auto surface = vtkSmartPointer<vtkPolyData>::Take(read_polydata(path, error));
    if (!surface || !error.empty()) throw std::runtime_error(error);

    vtkNew<vtkTriangleFilter> filter;
    filter->SetInputData(surface);
    filter->PassVertsOff();
    filter->PassLinesOff();
    filter->Update();
    vtkPolyData* cut = filter->GetOutput();
    const vtkIdType points = cut->GetNumberOfPoints();
    const vtkIdType triangles = cut->GetNumberOfPolys();
    if (triangles == 0) throw std::runtime_error(std::string(path) + ": holds no triangles");
    if (points > std::numeric_limits<int>::max())
        throw std::runtime_error(std::string(path) + ": more than 2147483647 points");

    Triangles result;
    result.point_count = points;
    result.triangle_count = triangles;
    result.points = new_array<double>(3 * points);
    try {
        result.triangles = new_array<int>(3 * triangles);
    } catch (...) {
        std::free(result.points);
        throw;
    }
    for (vtkIdType i = 0; i < points; ++i)
        cut->GetPoint(i, result.points + 3 * i);
    int* out = result.triangles;
    const auto cell = vtkSmartPointer<vtkCellArrayIterator>::Take(cut->GetPolys()->NewIterator());
    for (cell->GoToFirstCell(); !cell->IsDoneWithTraversal(); cell->GoToNextCell()) {
        vtkIdType size = 0;
        const vtkIdType* ids = nullptr;
        cell->GetCurrentCell(size, ids);
        for (int corner = 0; corner < 3; ++corner)
            *out++ = static_cast<int>(ids[corner]);
    }
    return result;
}

} // namespace

int amontons_vtk_read_surface(const char* path, double** points, long* point_count, int** triangles,
                              long* triangle_count, char* message, int message_size)
{
    Triangles result;
    int failed = 0;
    try {
        result = read_triangles(path);
    } catch (const std::exception& error) {
        if (message && message_size > 0)
            std::snprintf(message, static_cast<std::size_t>(message_size), "%s", error.what());
        failed = 1;
    }
    *points = result.points;
    *point_count = result.point_count;
    *triangles = result.triangles;
    *triangle_count = result.triangle_count;
    return failed;
}

void amontons_vtk_free(void* array)
{
    std::free(array);
}
