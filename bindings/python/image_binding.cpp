#include "bindings/python/image.hpp"
#include "bindings/python/stepper.hpp"

#include <cmath>

// xray() of Python (amontons/image.py).

namespace amontons::python {
namespace {

using ImageNumbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Image = py::array_t<std::uint8_t, py::array::c_style>;

/// @param camera  source, target, up: 9 numbers, and the width
py::array xray(const std::vector<std::vector<BeamRecord>>& all, const ImageNumbers& camera,
               int height, int width, double attenuation, double white, double noise,
               std::uint64_t seed)
{
    XrayCamera c;
    for (int k = 0; k < 3; ++k) {
        c.source[k] = camera.at(k);
        c.target[k] = camera.at(3 + k);
        c.up[k] = camera.at(6 + k);
    }
    c.width = camera.at(9);
    XrayOptions o;
    o.height = height;
    o.width = width;
    o.attenuation = attenuation;
    o.white = white;
    o.noise = noise;
    Image images({py::ssize_t(all.size()), py::ssize_t(height), py::ssize_t(width)});
    std::uint8_t* out = images.mutable_data();
    const py::gil_scoped_release free;
    for (std::size_t i = 0; i < all.size(); ++i) {
        o.seed = seed + i;
        draw_xray(all[i], c, o, out + i * std::size_t(height) * std::size_t(width));
    }
    return images;
}

/// Wires and rods of simulations.
py::array xray_of_simulations(const std::vector<std::shared_ptr<Stepper>>& all,
                              const ImageNumbers& camera, int height, int width, double attenuation,
                              double white, double noise, std::uint64_t seed)
{
    std::vector<std::vector<BeamRecord>> beams;
    for (const auto& s : all) {
        if (!s->record())
            throw_runtime("nothing to see before the first step, which is the state at the start");
        beams.push_back(s->record()->step.beams);
    }
    return xray(beams, camera, height, width, attenuation, white, noise, seed);
}

/// A polyline of one radius.
py::array xray_of_line(const ImageNumbers& points, double radius, const ImageNumbers& camera,
                       int height, int width, double attenuation, double white, double noise,
                       std::uint64_t seed)
{
    BeamRecord b;
    for (py::ssize_t i = 0; i < points.shape(0); ++i)
        b.points.emplace_back(points.at(i, 0), points.at(i, 1), points.at(i, 2));
    b.fields = {{"radius", "m", 1, std::vector<double>(b.points.size(), radius)}};
    return xray({{b}}, camera, height, width, attenuation, white, noise, seed);
}

} // namespace

void add_image(py::module_& module)
{
    module.def("xray_of_simulations", xray_of_simulations);
    module.def("xray_of_line", xray_of_line);
}

} // namespace amontons::python
