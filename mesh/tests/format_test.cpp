#include "mesh/format/obj.hpp"
#include "mesh/format/ply.hpp"
#include "mesh/format/stl.hpp"
#include <doctest/doctest.h>
using namespace amontons;
TEST_CASE("placeholder")
{
    SurfaceMesh m;
    m.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    m.triangles = {{0, 1, 2}};
    for (const auto& r :
         {parse_stl(stl_bytes(m), "a"), parse_stl(stl_text(m), "a"), parse_obj(obj_text(m), "a"),
          parse_ply(ply_bytes(m), "a"), parse_ply(ply_bytes(m, PlyEncoding::ascii), "a"),
          parse_ply(ply_bytes(m, PlyEncoding::big_endian), "a")}) {
        CHECK(r.points == m.points);
        CHECK(r.triangles == m.triangles);
    }
}
