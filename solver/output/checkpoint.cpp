#include "solver/output/checkpoint.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"

#include <bit>
#include <cstring>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr std::string_view kMagic = "amontons checkpoint\n"; // so that `head` states what it is
constexpr std::uint64_t kVersion = 10;
constexpr std::uint64_t kOrder = 0x0102030405060708; // reads differently on a foreign machine

void put_number(std::string& bytes, std::uint64_t value)
{
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Takes numbers off the front; after a failure all are 0.
class NumberReader {
public:
    explicit NumberReader(std::string_view bytes) : rest_(bytes) {}
    std::uint64_t number()
    {
        std::uint64_t value = 0;
        if (rest_.size() < sizeof value) {
            failed_ = true;
            rest_ = {};
            return 0;
        }
        std::memcpy(&value, rest_.data(), sizeof value);
        rest_.remove_prefix(sizeof value);
        return value;
    }
    std::string_view rest() const { return rest_; }
    bool failed() const { return failed_; }

private:
    std::string_view rest_;
    bool failed_ = false;
};

} // namespace

std::string checkpoint_bytes(const Checkpoint& c)
{
    std::string bytes(kMagic);
    bytes.reserve(kMagic.size() + 96 + 16 * c.frames.size() + c.state.size());
    for (const std::uint64_t v :
         {kVersion, kOrder, c.scene_hash, static_cast<std::uint64_t>(c.step),
          std::bit_cast<std::uint64_t>(c.time), c.history_bytes, c.history_hash,
          static_cast<std::uint64_t>(c.frames.size()), static_cast<std::uint64_t>(c.state.size())})
        put_number(bytes, v);
    for (const Checkpoint::Frame& f : c.frames) {
        put_number(bytes, static_cast<std::uint64_t>(f.step));
        put_number(bytes, std::bit_cast<std::uint64_t>(f.time));
    }
    bytes.append(reinterpret_cast<const char*>(c.state.data()), c.state.size());
    put_number(bytes, hash_bytes(bytes));
    return bytes;
}

Checkpoint read_checkpoint(std::string_view bytes, const std::string& file)
{
    const auto refuse = [&](const std::string& found) {
        throw InputError({{file, "", found,
                           "an undamaged checkpoint of this version; without "
                           "--resume the run starts anew"}});
    };
    if (bytes.substr(0, kMagic.size()) != kMagic) refuse("no checkpoint");
    NumberReader in(bytes.substr(kMagic.size()));
    const std::uint64_t version = in.number(), order = in.number();
    if (in.failed()) refuse("a damaged checkpoint (cut off)");
    if (order != kOrder) refuse("a checkpoint of a machine with another byte order");
    if (version != kVersion) refuse(fmt::format("a checkpoint of version {}", version));

    Checkpoint c;
    c.scene_hash = in.number();
    c.step = static_cast<std::int64_t>(in.number());
    c.time = std::bit_cast<double>(in.number());
    c.history_bytes = in.number();
    c.history_hash = in.number();
    const std::uint64_t frames = in.number(), state = in.number();
    // Sizes are compared before anything is reserved: a damaged one may be any number.
    const std::uint64_t rest = in.rest().size();
    if (in.failed() || frames > rest / 16 || state > rest - 16 * frames ||
        rest != 16 * frames + state + sizeof(std::uint64_t))
        refuse("a damaged checkpoint (wrong size)");
    std::uint64_t hash = 0;
    std::memcpy(&hash, bytes.data() + bytes.size() - sizeof hash, sizeof hash);
    if (hash != hash_bytes(bytes.substr(0, bytes.size() - sizeof hash)))
        refuse("a damaged checkpoint (its hash does not fit)");
    for (std::uint64_t i = 0; i < frames; ++i) {
        const auto step = static_cast<std::int64_t>(in.number());
        c.frames.push_back({step, std::bit_cast<double>(in.number())});
    }
    c.state.resize(state);
    if (state > 0) std::memcpy(c.state.data(), in.rest().data(), state);
    return c;
}

} // namespace amontons
