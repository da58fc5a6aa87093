#include "contact/named_arrays.hpp"

#include <cstring>
#include <stdexcept>

namespace amontons {
namespace {

// An array: kind, length of the name, count of the values, name, values.
struct Head {
    std::uint64_t kind = 0, name = 0, count = 0;
};
static_assert(sizeof(Head) == 24);

template <class Value> constexpr std::size_t size_of_one()
{
    if constexpr (requires { typename Value::value_type; })
        return sizeof(typename Value::value_type);
    return 1;
}

const std::string& bytes_of(const Unreadable& u)
{
    return u.reason;
}
template <class Value> const Value& bytes_of(const Value& v)
{
    return v;
}

class Reader {
public:
    explicit Reader(std::string_view bytes) : left_(bytes) {}
    bool done() const { return left_.empty(); }

    template <class T> void take(T* to, std::uint64_t count)
    {
        if (count > left_.size() / sizeof(T)) throw std::runtime_error("arrays end in the middle");
        const auto size = static_cast<std::size_t>(count) * sizeof(T);
        if (size > 0) std::memcpy(to, left_.data(), size);
        left_.remove_prefix(size);
    }
    template <class Values> Values values(std::uint64_t count)
    {
        using T = typename Values::value_type;
        if (count > left_.size() / sizeof(T)) throw std::runtime_error("arrays end in the middle");
        Values v(static_cast<std::size_t>(count), T{});
        take(v.data(), count);
        return v;
    }

private:
    std::string_view left_;
};

} // namespace

std::string pack_arrays(const std::vector<NamedArray>& arrays)
{
    std::string out;
    for (const NamedArray& a : arrays)
        std::visit(
            [&](const auto& value) {
                const auto& values = bytes_of(value);
                const Head head{a.value.index(), a.name.size(), values.size()};
                out.append(reinterpret_cast<const char*>(&head), sizeof head);
                out += a.name;
                out.append(reinterpret_cast<const char*>(values.data()),
                           values.size() * size_of_one<std::decay_t<decltype(values)>>());
            },
            a.value);
    return out;
}

std::vector<NamedArray> unpack_arrays(std::string_view bytes)
{
    std::vector<NamedArray> arrays;
    for (Reader in(bytes); !in.done();) {
        Head head;
        in.take(&head, 1);
        NamedArray a;
        a.name = in.values<std::string>(head.name);
        switch (head.kind) {
        case 0:
            a.value = in.values<std::vector<std::int32_t>>(head.count);
            break;
        case 1:
            a.value = in.values<std::vector<double>>(head.count);
            break;
        case 2:
            a.value = in.values<std::string>(head.count);
            break;
        case 3:
            a.value = Unreadable{in.values<std::string>(head.count)};
            break;
        default:
            throw std::runtime_error("no such kind of array");
        }
        arrays.push_back(std::move(a));
    }
    return arrays;
}

} // namespace amontons
