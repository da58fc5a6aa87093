#pragma once

#include "solver/record/step_record.hpp"

#include <cstdint>
#include <vector>

namespace amontons::python {

/// A point source and a plane across its main ray: an image of a fluoroscope.
struct XrayCamera {
    Vec3 source = Vec3::Zero(); ///< [m]
    Vec3 target = Vec3::Zero(); ///< middle of the plane [m]
    Vec3 up = Vec3::UnitZ();    ///< of the image
    double width = 0;           ///< of the image, on the plane [m]
};

/// How wires and rods darken it.
struct XrayOptions {
    int height = 256, width = 256; ///< pixels
    double attenuation = 2000;     ///< of the wires' material [1/m]
    double white = 200;            ///< grey where nothing is
    double noise = 5;              ///< standard deviation of Gaussian noise, in greys
    std::uint64_t seed = 0;
};

/// Beer and Lambert: white exp(-attenuation l) with l the mean length of a pixel's rays inside the
/// wires [m]. Their volume is shared out to the pixels, so that a wire thinner than a pixel, or one
/// that runs along the rays, darkens as much as it must. Wires are taken as thin beside their
/// distance from the source: a section is magnified as its middle is.
/// @param out  height x width, row by row from the top
void draw_xray(const std::vector<BeamRecord>& beams, const XrayCamera& camera,
               const XrayOptions& options, std::uint8_t* out);

} // namespace amontons::python
