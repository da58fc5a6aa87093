#include "mesh/base/base64.hpp"
#include "solver/program/serve_request.hpp"

#include <cstdint>

using namespace amontons;

// A line of a client: it is a request, or every thing that is wrong with it is reported.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const ServeRequest r = read_request({reinterpret_cast<const char*>(data), size}, true);
    for (const Issue& issue : r.issues)
        AMONTONS_ASSERT(!issue.found.empty() && !issue.allowed.empty());
    AMONTONS_ASSERT(!r.id.empty() && r.id.find('\n') == std::string::npos);
    if (!r.issues.empty()) return 0;
    AMONTONS_ASSERT(r.id != "null" && r.count >= 1 && r.path.find('=') == std::string::npos);
    if (r.what == ServeRequest::What::set) AMONTONS_ASSERT(!r.path.empty() && !r.value.empty());
    AMONTONS_ASSERT(from_base64(to_base64(r.state)) == r.state);
    return 0;
}
