#include "solver/fclib_file.hpp"

#include "contact/fclib/fclib_module.hpp"
#include "mesh/base/file.hpp"
#include "solver/module.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <unistd.h>

namespace amontons {
namespace {

constexpr const char* kSignature = "\x89HDF\r\n\x1a\n";
constexpr const char* kAllowed = "an HDF5 file in FCLib's layout";

struct Entries {
    decltype(amontons_fclib_read)* read;
    decltype(amontons_fclib_write)* write;
    decltype(amontons_fclib_free)* free;
};

Entries module(const std::string& file)
{
    try {
        const Module fclib("fclib");
        return {fclib.function<decltype(amontons_fclib_read)>("amontons_fclib_read"),
                fclib.function<decltype(amontons_fclib_write)>("amontons_fclib_write"),
                fclib.function<decltype(amontons_fclib_free)>("amontons_fclib_free")};
    } catch (const std::runtime_error& error) {
        throw InputError({{file, "", error.what(), "an installed FCLib module"}});
    }
}

/// Half of the machine's memory [bytes].
double memory_for_values()
{
    return 0.5 * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
           static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// HDF5 allows a head of the user's own before it, of 512, 1024, 2048, ... bytes.
bool has_signature(std::string_view bytes)
{
    const std::string_view signature(kSignature, 8);
    for (std::size_t at = 0; at + signature.size() <= bytes.size(); at = at == 0 ? 512 : 2 * at)
        if (bytes.substr(at, signature.size()) == signature) return true;
    return false;
}

std::string write(std::string_view base, const std::vector<NamedArray>& arrays)
{
    const Entries fclib = module("contact problem");
    const std::string packed = pack_arrays(arrays);
    char* bytes = nullptr;
    long size = 0;
    char message[1000] = "";
    const int failed =
        fclib.write(base.data(), static_cast<long>(base.size()), packed.data(),
                    static_cast<long>(packed.size()), &bytes, &size, message, sizeof message);
    const std::unique_ptr<char, decltype(fclib.free)> owner(bytes, fclib.free);
    if (failed) throw std::runtime_error(std::string("the FCLib module cannot write: ") + message);
    return {bytes, static_cast<std::size_t>(size)};
}

} // namespace

FclibProblem parse_fclib(std::string_view bytes, const std::string& path)
{
    if (!has_signature(bytes))
        throw InputError({{path, "",
                           bytes.empty() ? std::string("an empty file")
                                         : "no HDF5 file, it begins with " + quoted_text(bytes, 8),
                           kAllowed}});
    const Entries fclib = module(path);
    char* packed = nullptr;
    long size = 0;
    char message[1000] = "";
    const double time = 30 + 1e-6 * static_cast<double>(bytes.size()); // 1 MB/s is slow
    const int failed =
        fclib.read(bytes.data(), static_cast<long>(bytes.size()), kFclibGroups, memory_for_values(),
                   time, &packed, &size, message, sizeof message);
    const std::unique_ptr<char, decltype(fclib.free)> owner(packed, fclib.free);
    if (failed) throw InputError({{path, "", message, kAllowed}});
    return fclib_problem(unpack_arrays({packed, static_cast<std::size_t>(size)}), path);
}

FclibProblem read_fclib(const std::string& path)
{
    return parse_fclib(read_file(path), path);
}

std::string fclib_bytes(const FclibProblem& problem)
{
    return fclib_file_of(fclib_arrays(problem));
}

std::string fclib_file_of(const std::vector<NamedArray>& arrays)
{
    return write({}, arrays);
}

std::string with_solution(std::string_view file, const FclibSolution& solution,
                          Eigen::Index bilateral)
{
    return write(file, fclib_solution_arrays(solution, bilateral));
}

void write_fclib(const std::string& path, const FclibProblem& problem)
{
    write_file(path, fclib_bytes(problem));
}

} // namespace amontons
