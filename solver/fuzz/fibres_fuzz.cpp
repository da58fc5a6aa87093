#include "mesh/base/error.hpp"
#include "solver/body/fibres.hpp"

#include <cmath>

using namespace amontons;

// Directions that are read are unit vectors, as many as requested, and written out read the same.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    for (std::size_t count = 0; count < 4; ++count)
        try {
            const std::vector<Vec3> fibres = parse_fibres(text, "fuzz", count);
            AMONTONS_ASSERT(fibres.size() == count);
            for (const Vec3& f : fibres) {
                AMONTONS_ASSERT(std::abs(f.norm() - 1) < 1e-12);
                const Mat3 axes = fibre_axes(f);
                AMONTONS_ASSERT((axes.transpose() * axes - Mat3::Identity()).norm() < 1e-12);
            }
        } catch (const InputError&) {
        }
    return 0;
}
