#include "solver/output/live_frame.hpp"

#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace amontons;

namespace {

nlohmann::json live_header(const std::string& bytes, std::size_t& begin)
{
    REQUIRE(bytes.substr(0, 4) == "AMF1");
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data() + 4, 4);
    CHECK(length % 8 == 0);
    begin = 8 + length;
    return nlohmann::json::parse(bytes.substr(8, length));
}

} // namespace

TEST_CASE("a live frame contains every array where its header specifies")
{
    ViewFrame sent;
    sent.caption = "t = 1 s";
    sent.contacts = {1, 2, 3, 4, 5, 6};
    sent.normal_forces = {4, 0, 0};
    sent.pairs = {1, 0};
    sent.names = {"die", "wire"};
    sent.shapes.push_back({"die", ViewShape::rigid, {0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {}});
    sent.shapes.push_back({"wire", ViewShape::wire, {1, 2, 3}, {}, {0.5F}});
    const std::string bytes = live_frame_bytes(sent, {7, 3, 12, 0.6, true});
    std::size_t begin = 0;
    const nlohmann::json head = live_header(bytes, begin);
    CHECK(head["seq"] == 7);
    CHECK(head["before"] == 3);
    CHECK(head["step"] == 12);
    CHECK(head["time"] == 0.6);
    CHECK(head["done"] == true);
    CHECK(head["bodies"][1]["kind"] == "wire");
    int found = 0;
    const auto check = [&](const char* name, const auto& numbers) {
        for (const auto& a : head["arrays"]) {
            if (a["name"] != name) continue;
            ++found;
            CHECK(a["offset"].get<std::size_t>() % 8 == 0);
            CHECK(a["shape"][0].get<std::size_t>() * a["shape"][1].get<std::size_t>() ==
                  numbers.size());
            CHECK(std::memcmp(bytes.data() + begin + a["offset"].get<std::size_t>(), numbers.data(),
                              4 * numbers.size()) == 0);
        }
    };
    check("die/points", sent.shapes[0].points);
    check("die/triangles", sent.shapes[0].triangles);
    check("wire/values", sent.shapes[1].values);
    check("/contacts", sent.contacts);
    check("/normal_forces", sent.normal_forces);
    check("/pairs", sent.pairs);
    CHECK(found == 6);
    CHECK(head["names"] == nlohmann::json({"die", "wire"}));
}

TEST_CASE("many points are wrong by 8e-6 of their box at most, wherever it lies")
{
    ViewFrame sent;
    ViewShape& s = sent.shapes.emplace_back(ViewShape{"bed", ViewShape::solid, {}, {}, {}});
    for (int i = 0; i < 30000; ++i)
        for (int k = 0; k < 3; ++k)
            s.points.push_back(float(3 + 0.1 * (k + 1) * std::sin(0.01 * i + k)));
    std::size_t begin = 0;
    const std::string bytes = live_frame_bytes(sent, {});
    const nlohmann::json head = live_header(bytes, begin), a = head["arrays"][0];
    REQUIRE(a["type"] == "i16");
    double worst = 0;
    for (std::size_t i = 0; i < s.points.size(); ++i) {
        std::int16_t x = 0;
        std::memcpy(&x, bytes.data() + begin + 2 * i, 2);
        worst = std::max(worst, std::abs(x * a["scale"].get<double>() +
                                         a["shift"][i % 3].get<double>() - s.points[i]));
    }
    CHECK(worst <= 8e-6 * 0.6);
    CHECK(worst > 0);
}
