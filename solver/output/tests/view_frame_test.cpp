#include "solver/output/vtk/view_frame.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/output/view_maker.hpp"

#include <doctest/doctest.h>
#include <stdexcept>

using namespace amontons;

TEST_CASE("frames arrive whole as they were sent in whatever pieces they come")
{
    ViewFrame sent;
    sent.caption = "t = 1 s";
    sent.contacts = {1, 2, 3, 4, 5, 6};
    sent.shapes.push_back({"die", ViewShape::rigid, {0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {}});
    sent.shapes.push_back({"wire", ViewShape::wire, {1, 2, 3}, {}, {0.5F}});
    const std::string bytes = view_bytes(sent) + view_bytes({});
    std::string come;
    ViewFrame frame;
    int frames = 0;
    for (const char c : bytes) {
        come += c;
        if (!take_view_frame(come, frame)) continue;
        if (++frames == 2) continue;
        CHECK(frame.caption == sent.caption);
        CHECK(frame.contacts == sent.contacts);
        REQUIRE(frame.shapes.size() == 2);
        CHECK(frame.shapes[0].name == "die");
        CHECK(frame.shapes[0].points == sent.shapes[0].points);
        CHECK(frame.shapes[0].triangles == sent.shapes[0].triangles);
        CHECK(frame.shapes[1].kind == ViewShape::wire);
        CHECK(frame.shapes[1].values == sent.shapes[1].values);
    }
    CHECK(frames == 2);
    CHECK(come.empty());
    std::string nonsense(100, '\xff');
    CHECK_THROWS_AS((void)take_view_frame(nonsense, frame), std::runtime_error);
}

TEST_CASE(
    "a body whose stress is round-off has no values to be coloured by, and one with stress has")
{
    const VolumeMesh mesh = make_solid_box({});
    BodyRecord body;
    body.name = "block";
    body.elements = &mesh;
    body.points = mesh.nodes;
    body.stress_round_off = 1e-6;
    const auto values_at = [&](double stress) {
        body.point_fields = {
            {"von_mises_averaged", "Pa", 1, std::vector<double>(mesh.nodes.size(), stress)}};
        const std::vector<Obstacle> none; // outlives the maker
        ViewMaker maker(none, {});
        const ViewFrame frame = maker.frame(0, {}, {body}, {});
        REQUIRE(frame.shapes.size() == 1);
        return frame.shapes[0].values.size();
    };
    CHECK(values_at(3e-7) == 0);
    CHECK(values_at(3e-6) > 0);
}
