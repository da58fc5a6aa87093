#include "bindings/python/image.hpp"
#include "bindings/python/stepper.hpp"

#include <atomic>
#include <cmath>
#include <thread>

// xray() of Python (amontons/image.py).

namespace amontons::python {
namespace {

using ImageNumbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

struct ImageArguments {
    XrayCamera camera;
    XrayOptions options;
};

/// @param camera  source, target, up: 9 numbers, and the width
ImageArguments image_arguments(const ImageNumbers& camera, int height, int width,
                               double attenuation, double white, double noise, std::uint64_t seed)
{
    ImageArguments a;
    for (int k = 0; k < 3; ++k) {
        a.camera.source[k] = camera.at(k);
        a.camera.target[k] = camera.at(3 + k);
        a.camera.up[k] = camera.at(6 + k);
    }
    a.camera.width = camera.at(9);
    a.options = {height, width, attenuation, white, noise, seed};
    return a;
}

/// Wires and rods of simulations, an image each, on so many threads: the same bits for any number.
py::array xray_of_simulations(const std::vector<std::shared_ptr<Stepper>>& all,
                              const ImageNumbers& camera, int height, int width, double attenuation,
                              double white, double noise, std::uint64_t seed, int threads,
                              const py::object& out)
{
    const ImageArguments a =
        image_arguments(camera, height, width, attenuation, white, noise, seed);
    std::vector<Record> records;
    for (const auto& s : all) {
        const Stepper::Use use(*s, Stepper::Purpose::read);
        if (!s->record())
            throw_runtime("nothing to see before the first step, which is the state at the start");
        records.push_back(s->record());
    }
    auto images = out_array<std::uint8_t>(
        out, "uint8", {py::ssize_t(all.size()), py::ssize_t(height), py::ssize_t(width)});
    std::uint8_t* first = images.mutable_data();
    const py::gil_scoped_release free;
    std::atomic<std::size_t> next{0};
    const auto draw = [&] {
        for (std::size_t i; (i = next++) < records.size();) {
            XrayOptions o = a.options;
            o.seed += i;
            draw_xray(records[i]->step.beams, a.camera, o,
                      first + i * std::size_t(height) * std::size_t(width));
        }
    };
    std::vector<std::thread> others;
    for (std::size_t k = 1; k < std::min(std::size_t(threads), records.size()); ++k)
        others.emplace_back(draw);
    draw();
    for (std::thread& t : others)
        t.join();
    return images;
}

/// A polyline of one radius.
py::array xray_of_line(const ImageNumbers& points, double radius, const ImageNumbers& camera,
                       int height, int width, double attenuation, double white, double noise,
                       std::uint64_t seed)
{
    const ImageArguments a =
        image_arguments(camera, height, width, attenuation, white, noise, seed);
    BeamRecord b;
    for (py::ssize_t i = 0; i < points.shape(0); ++i)
        b.points.emplace_back(points.at(i, 0), points.at(i, 1), points.at(i, 2));
    b.fields = {{"radius", "m", 1, std::vector<double>(b.points.size(), radius)}};
    py::array_t<std::uint8_t> image({py::ssize_t(height), py::ssize_t(width)});
    std::uint8_t* first = image.mutable_data();
    const py::gil_scoped_release free;
    draw_xray({b}, a.camera, a.options, first);
    return image;
}

} // namespace

void add_image(py::module_& module)
{
    module.def("xray_of_simulations", xray_of_simulations);
    module.def("xray_of_line", xray_of_line);
}

} // namespace amontons::python
