#include "solver/output/vtk/view_frame.hpp"

#include <cstring>
#include <stdexcept>

namespace amontons {
namespace {

constexpr std::uint64_t kMost = std::uint64_t(1) << 31; // of a frame [bytes]

template <class T> void put_array(std::string& out, const T* values, std::size_t count)
{
    const std::uint64_t n = count;
    out.append(reinterpret_cast<const char*>(&n), sizeof n);
    if (count > 0) out.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

class FrameReader {
public:
    explicit FrameReader(std::string_view bytes) : bytes_(bytes) {}

    std::uint64_t number()
    {
        std::uint64_t n = 0;
        copy(&n, sizeof n);
        return n;
    }
    template <class Container> void array(Container& out)
    {
        using T = typename Container::value_type;
        const std::uint64_t n = number();
        if (n > bytes_.size() / sizeof(T)) throw std::runtime_error("a cut frame");
        out.resize(n);
        copy(out.data(), n * sizeof(T));
    }

private:
    void copy(void* to, std::size_t size)
    {
        if (size > bytes_.size()) throw std::runtime_error("a cut frame");
        if (size > 0) std::memcpy(to, bytes_.data(), size);
        bytes_.remove_prefix(size);
    }
    std::string_view bytes_;
};

} // namespace

std::string view_bytes(const ViewFrame& frame)
{
    std::string body;
    put_array(body, frame.caption.data(), frame.caption.size());
    put_array(body, frame.contacts.data(), frame.contacts.size());
    const std::uint64_t shapes = frame.shapes.size();
    body.append(reinterpret_cast<const char*>(&shapes), sizeof shapes);
    for (const ViewShape& s : frame.shapes) {
        put_array(body, s.name.data(), s.name.size());
        put_array(body, &s.kind, 1);
        put_array(body, s.points.data(), s.points.size());
        put_array(body, s.triangles.data(), s.triangles.size());
        put_array(body, s.values.data(), s.values.size());
    }
    std::string out;
    put_array(out, body.data(), body.size());
    return out;
}

bool take_view_frame(std::string& bytes, ViewFrame& frame)
{
    std::uint64_t size = 0;
    if (bytes.size() < sizeof size) return false;
    std::memcpy(&size, bytes.data(), sizeof size);
    if (size > kMost) throw std::runtime_error("no frame");
    if (bytes.size() < sizeof size + size) return false;
    FrameReader in(std::string_view(bytes).substr(sizeof size, size));
    frame = {};
    in.array(frame.caption);
    in.array(frame.contacts);
    const std::uint64_t shapes = in.number();
    for (std::uint64_t i = 0; i < shapes; ++i) {
        ViewShape& s = frame.shapes.emplace_back();
        in.array(s.name);
        std::vector<std::int32_t> kind;
        in.array(kind);
        if (kind.size() != 1) throw std::runtime_error("no frame");
        s.kind = kind[0];
        in.array(s.points);
        in.array(s.triangles);
        in.array(s.values);
    }
    bytes.erase(0, sizeof size + size);
    return true;
}

} // namespace amontons
