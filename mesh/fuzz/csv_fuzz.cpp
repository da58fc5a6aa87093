#include "mesh/format/csv.hpp"
#include "mesh/fuzz/laws.hpp"
#include "mesh/size_field.hpp"

#include <cmath>

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        const Polyline line = parse_centreline_csv(as_text(data, size), "fuzz");
        obey_laws(line);
        const Polyline again = parse_centreline_csv(centreline_csv(line), "fuzz");
        AMONTONS_ASSERT(again.points == line.points && again.radius == line.radius);
    } catch (const InputError&) {
    }
    try {
        const auto sources = parse_size_field_csv(as_text(data, size), "fuzz");
        AMONTONS_ASSERT(!sources.empty());
        for (const SizeSource& s : sources)
            AMONTONS_ASSERT(s.at.allFinite() && s.size > 0 && std::isfinite(s.size));
    } catch (const InputError&) {
    }
    return 0;
}
