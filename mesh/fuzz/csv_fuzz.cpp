#include "mesh/format/csv.hpp"
#include "mesh/fuzz/laws.hpp"

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
    return 0;
}
