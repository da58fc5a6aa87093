#include "mesh/format/plain.hpp"

#include "mesh/fuzz/volume_fuzz_laws.hpp"

using namespace amontons;

// The two files in one: nodes, a line with %, elements.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view text = as_text(data, size);
    const std::size_t cut = std::min(text.find('%'), text.size());
    try {
        obey_volume_laws(
            parse_plain(text.substr(0, cut), text.substr(std::min(cut + 1, text.size())), "n", "e")
                .mesh,
            [](const VolumeMesh& m) {
                const PlainText again = plain_text(m);
                return parse_plain(again.nodes, again.elements, "n", "e").mesh;
            });
    } catch (const InputError&) {
    }
    return 0;
}
