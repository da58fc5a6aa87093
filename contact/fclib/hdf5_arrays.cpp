// HDF5's C library, and not libfclib: libfclib ends the process on what it does not expect, takes
// sizes from one dataset for another, and has no limit. What it writes is read here, and what is
// written here it reads: the tests of this folder link it.

#include "contact/fclib/child_process.hpp"
#include "contact/fclib/fclib_module.hpp"
#include "contact/named_arrays.hpp"

#include <hdf5.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace {

using amontons::NamedArray;
using amontons::Unreadable;

constexpr int kDepth = 8;             // of groups in groups
constexpr std::size_t kMany = 10'000; // links; FCLib has some thirty
constexpr hsize_t kChunk = 1 << 16;   // values that are compressed together
constexpr hsize_t kSmall = 512;       // values that are not worth compressing

/// One of HDF5's numbers for what is open.
class Id {
public:
    Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
    Id(const Id&) = delete;
    Id& operator=(const Id&) = delete;
    ~Id()
    {
        if (id_ >= 0) close_(id_);
    }
    operator hid_t() const { return id_; } // NOLINT: it stands for the number everywhere
    bool valid() const { return id_ >= 0; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

extern "C" herr_t keep_first(unsigned n, const H5E_error2_t* error, void* text)
{
    if (n == 0 && error->desc) *static_cast<std::string*>(text) = error->desc;
    return 0;
}

/// What HDF5 has to report about the last call that failed, where it began.
std::string last_error()
{
    std::string text;
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &text);
    return text.empty() ? "" : " (HDF5: " + text + ")";
}

[[noreturn]] void fail(const std::string& what)
{
    throw std::runtime_error(what + last_error());
}

/// A file that lives in memory. @param bytes  what it starts as; empty: a new one
Id open_image(const char* bytes, std::size_t size, bool write)
{
    const Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    if (H5Pset_fapl_core(access, 1 << 20, 0) < 0) fail("no file in memory");
    if (size == 0) return Id(H5Fcreate("memory", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
    // HDF5 takes a copy.
    if (H5Pset_file_image(access, const_cast<char*>(bytes), size) < 0) fail("no file in memory");
    return Id(H5Fopen("memory", write ? H5F_ACC_RDWR : H5F_ACC_RDONLY, access), H5Fclose);
}

class FileReader {
public:
    explicit FileReader(double memory) : memory_(memory) {}

    void group(hid_t where, const std::string& name, int depth)
    {
        if (depth > kDepth) throw std::runtime_error("groups in groups without an end at " + name);
        H5G_info_t info;
        if (H5Gget_info(where, &info) < 0) fail("the group " + name + " cannot be read");
        for (hsize_t k = 0; k < info.nlinks; ++k) {
            if (++links_ > kMany) throw std::runtime_error("more than 10000 datasets");
            const ssize_t length = H5Lget_name_by_idx(where, ".", H5_INDEX_NAME, H5_ITER_INC, k,
                                                      nullptr, 0, H5P_DEFAULT);
            if (length <= 0 || length > 1000) fail("the group " + name + " cannot be read");
            std::string link(static_cast<std::size_t>(length) + 1, '\0');
            H5Lget_name_by_idx(where, ".", H5_INDEX_NAME, H5_ITER_INC, k, link.data(), link.size(),
                               H5P_DEFAULT);
            link.resize(static_cast<std::size_t>(length));
            member(where, link, name + "/" + link, depth);
        }
    }

    /// What a link leads to, if it stays within the file.
    void member(hid_t where, const std::string& link, const std::string& name, int depth)
    {
        H5L_info_t info;
        if (H5Lget_info(where, link.c_str(), &info, H5P_DEFAULT) < 0)
            fail("the link " + name + " cannot be read");
        if (info.type != H5L_TYPE_HARD) {
            arrays.push_back({name, Unreadable{"a link to another place"}});
            return;
        }
        const Id object(H5Oopen(where, link.c_str(), H5P_DEFAULT), H5Oclose);
        if (!object.valid()) fail(name + " cannot be opened");
        if (H5Iget_type(object) == H5I_GROUP)
            group(object, name, depth + 1);
        else if (H5Iget_type(object) == H5I_DATASET)
            arrays.push_back({name, dataset(object, name)});
    }

    std::vector<NamedArray> arrays;

private:
    using Value = decltype(NamedArray::value);

    Value dataset(hid_t id, const std::string& name)
    {
        const Id space(H5Dget_space(id), H5Sclose), type(H5Dget_type(id), H5Tclose);
        const Id plan(H5Dget_create_plist(id), H5Pclose);
        if (!space.valid() || !type.valid() || !plan.valid()) fail(name + " cannot be read");
        const H5D_layout_t layout = H5Pget_layout(plan);
        if ((layout != H5D_CHUNKED && layout != H5D_CONTIGUOUS && layout != H5D_COMPACT) ||
            H5Pget_external_count(plan) != 0)
            return Unreadable{"values that lie in another file"};
        const hssize_t points = H5Sget_simple_extent_npoints(space);
        if (points < 0) fail(name + " has no size");
        const auto count = static_cast<std::size_t>(points);
        switch (H5Tget_class(type)) {
        case H5T_INTEGER:
            return integers(id, type, count, name);
        case H5T_FLOAT: {
            std::vector<double> values(take<double>(count, name));
            read(id, H5T_NATIVE_DOUBLE, values.data(), count, name);
            return values;
        }
        case H5T_STRING:
            return text(id, type, count, name);
        default:
            return Unreadable{"neither numbers nor text"};
        }
    }

    Value integers(hid_t id, hid_t type, std::size_t count, const std::string& name)
    {
        const std::size_t size = H5Tget_size(type);
        std::vector<std::int32_t> values(take<std::int32_t>(count, name));
        if (size < 4 || (size == 4 && H5Tget_sign(type) == H5T_SGN_2)) {
            read(id, H5T_NATIVE_INT32, values.data(), count, name);
            return values;
        }
        std::vector<std::int64_t> wide(take<std::int64_t>(count, name));
        read(id, H5T_NATIVE_INT64, wide.data(), count, name);
        memory_ += static_cast<double>(count) * sizeof(std::int64_t);
        for (std::size_t k = 0; k < count; ++k) {
            using Limits = std::numeric_limits<std::int32_t>;
            if (wide[k] < Limits::min() || wide[k] > Limits::max())
                return Unreadable{"the integer " + std::to_string(wide[k]) +
                                  ", too large for 32 bits"};
            values[k] = static_cast<std::int32_t>(wide[k]);
        }
        return values;
    }

    Value text(hid_t id, hid_t type, std::size_t count, const std::string& name)
    {
        if (count != 1) return Unreadable{std::to_string(count) + " texts instead of one"};
        if (H5Tis_variable_str(type) > 0) {
            const Id memory(H5Tcopy(H5T_C_S1), H5Tclose);
            H5Tset_size(memory, H5T_VARIABLE);
            H5Tset_cset(memory, H5Tget_cset(type));
            char* found = nullptr;
            read(id, memory, &found, 1, name);
            return std::string(found ? found : ""); // the child ends soon: nothing is given back
        }
        std::string found(take<char>(H5Tget_size(type), name), '\0');
        read(id, type, found.data(), found.size(), name);
        if (const std::size_t end = found.find('\0'); end != std::string::npos) found.resize(end);
        return found;
    }

    void read(hid_t id, hid_t type, void* to, std::size_t count, const std::string& name)
    {
        if (count > 0 && H5Dread(id, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) < 0)
            fail(name + " cannot be read");
    }

    /// Counts values against the limit before they take their place.
    template <class T> std::size_t take(std::size_t count, const std::string& name)
    {
        const double bytes = static_cast<double>(count) * sizeof(T);
        if (bytes > memory_) {
            std::ostringstream text;
            text << name << " has " << count << " values: more than the memory for it, "
                 << memory_ / 1e6 << " MB";
            throw std::runtime_error(text.str());
        }
        memory_ -= bytes;
        return count;
    }

    double memory_;
    std::size_t links_ = 0;
};

std::string read_arrays(const char* bytes, std::size_t size, const std::string& groups,
                        double memory)
{
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const Id file = open_image(bytes, size, false);
    if (!file.valid()) fail("no HDF5 file, or a damaged one");
    FileReader reader(memory);
    std::istringstream names(groups);
    for (std::string name; names >> name;)
        if (H5Lexists(file, name.c_str(), H5P_DEFAULT) > 0) reader.member(file, name, name, 0);
    return amontons::pack_arrays(reader.arrays);
}

// ---- writing

void write_values(hid_t file, const Id& links, const std::string& name, hid_t type, hsize_t count,
                  const void* values)
{
    const Id space(H5Screate_simple(1, &count, nullptr), H5Sclose);
    const Id plan(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    if (count > kSmall) {
        const hsize_t chunk = std::min(count, kChunk);
        H5Pset_chunk(plan, 1, &chunk);
        H5Pset_shuffle(plan);
        H5Pset_deflate(plan, 4);
    }
    const Id set(H5Dcreate2(file, name.c_str(), type, space, links, plan, H5P_DEFAULT), H5Dclose);
    if (!set.valid() ||
        (count > 0 && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0))
        fail(name + " cannot be written");
}

void write_text(hid_t file, const Id& links, const std::string& name, const std::string& text)
{
    const Id type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
    H5Tset_size(type, text.size() + 1);
    H5Tset_strpad(type, H5T_STR_NULLTERM);
    const Id set(H5Dcreate2(file, name.c_str(), type, space, links, H5P_DEFAULT, H5P_DEFAULT),
                 H5Dclose);
    if (!set.valid() || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()) < 0)
        fail(name + " cannot be written");
}

std::string write_arrays(const char* base, std::size_t base_size, std::string_view packed)
{
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const Id file = open_image(base, base_size, true);
    if (!file.valid()) fail("no HDF5 file, or a damaged one");
    const Id links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links, 1);
    std::vector<std::string> replaced;
    for (const NamedArray& array : amontons::unpack_arrays(packed)) {
        const std::string group = array.name.substr(0, array.name.find('/'));
        if (std::find(replaced.begin(), replaced.end(), group) == replaced.end()) {
            replaced.push_back(group);
            if (H5Lexists(file, group.c_str(), H5P_DEFAULT) > 0 &&
                H5Ldelete(file, group.c_str(), H5P_DEFAULT) < 0)
                fail("the group " + group + " cannot be replaced");
        }
        if (const auto* integers = std::get_if<0>(&array.value))
            write_values(file, links, array.name, H5T_NATIVE_INT32, integers->size(),
                         integers->data());
        else if (const auto* numbers = std::get_if<1>(&array.value))
            write_values(file, links, array.name, H5T_NATIVE_DOUBLE, numbers->size(),
                         numbers->data());
        else if (const auto* text = std::get_if<2>(&array.value))
            write_text(file, links, array.name, *text);
    }
    if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0) fail("the file cannot be finished");
    const ssize_t size = H5Fget_file_image(file, nullptr, 0);
    if (size <= 0) fail("the file cannot be finished");
    std::string image(static_cast<std::size_t>(size), '\0');
    if (H5Fget_file_image(file, image.data(), image.size()) < 0)
        fail("the file cannot be finished");
    return image;
}

int report(const char* text, char* message, int message_size)
{
    if (message && message_size > 0)
        std::snprintf(message, static_cast<std::size_t>(message_size), "%s", text);
    return 1;
}

} // namespace

int amontons_fclib_read(const char* file, long file_size, const char* groups, double memory,
                        double time, char** arrays, long* arrays_size, char* message,
                        int message_size)
{
    *arrays = nullptr;
    *arrays_size = 0;
    try {
        const auto size = static_cast<std::size_t>(std::max(0L, file_size));
        if (size == 0) return report("an empty file", message, message_size);
        // The library's copy of the file, the values, and the values packed: and 1 GB for it.
        const double space = 1e9 + 2.0 * static_cast<double>(size) + 3 * memory;
        const amontons::fclib_module::Bytes bytes = amontons::fclib_module::in_child_process(
            [&] { return read_arrays(file, size, groups, memory); }, space, time);
        *arrays = bytes.data;
        *arrays_size = bytes.size;
        return 0;
    } catch (const std::exception& error) {
        return report(error.what(), message, message_size);
    }
}

int amontons_fclib_write(const char* base, long base_size, const char* arrays, long arrays_size,
                         char** file, long* file_size, char* message, int message_size)
{
    *file = nullptr;
    *file_size = 0;
    try {
        const auto size = static_cast<std::size_t>(std::max(0L, base_size));
        const auto packed = static_cast<std::size_t>(std::max(0L, arrays_size));
        const double space = 1e9 + 4.0 * static_cast<double>(size + packed);
        const double time = 60 + 1e-6 * static_cast<double>(size + packed);
        const amontons::fclib_module::Bytes bytes = amontons::fclib_module::in_child_process(
            [&] {
                return write_arrays(base, size, {arrays, packed});
            },
            space, time);
        *file = bytes.data;
        *file_size = bytes.size;
        return 0;
    } catch (const std::exception& error) {
        return report(error.what(), message, message_size);
    }
}

void amontons_fclib_free(char* bytes)
{
    std::free(bytes);
}
