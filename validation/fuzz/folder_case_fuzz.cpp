#include "mesh/base/error.hpp"
#include "mesh/format/columns.hpp"
#include "validation/folder_case.hpp"
#include "validation/report.hpp"

#include <cstdint>

using namespace amontons;
using namespace amontons::validation;

// case.json, a reference curve, and what a child answers: whatever is refused is named, and what is
// read can be used.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        const FolderCase c =
            parse_folder_case(text, "fuzz", [](const std::string& f) { return f != "none"; });
        AMONTONS_ASSERT(!c.scenes.empty() && !c.measures.empty());
        for (const CaseMeasure& m : c.measures) {
            bool known = false;
            for (const CaseScene& s : c.scenes)
                known |= s.name == m.scene;
            AMONTONS_ASSERT(known && !m.what.empty() && m.tolerance >= 0);
        }
    } catch (const InputError& error) {
        for (const Issue& issue : error.issues())
            AMONTONS_ASSERT(!issue.file.empty() && !issue.found.empty() && !issue.allowed.empty());
    }
    try {
        const Columns table = parse_columns(text, "fuzz");
        for (const std::vector<double>& column : table.values)
            AMONTONS_ASSERT(column.size() == table.values[0].size());
        value_at(table.values.front(), table.values.back(), 0.5);
    } catch (const InputError&) {
    }
    try {
        const std::vector<CaseResult> results = read_results(text, "fuzz");
        read_results(json_of(results), "again");
        csv_of(results);
        markdown_of(results);
        html_of(results, "", {});
        plots_of(results);
    } catch (const InputError&) {
    }
    return 0;
}
