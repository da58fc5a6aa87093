#include "mesh/base/error.hpp"
#include "validation/study/table.hpp"

#include <cstdint>

using namespace amontons;
using namespace amontons::study;

// The folder of a study and what a run answers, from outside. What is read is written back the
// same, and no table of it breaks.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        const PointRecord r = read_record(text, "fuzz");
        const std::string again = record_text(r);
        AMONTONS_ASSERT(record_text(read_record(again, "again")) == again);
    } catch (const InputError&) {
    }
    try {
        const Definition d = read_definition(text, "fuzz");
        const std::string again = definition_text(d);
        AMONTONS_ASSERT(definition_text(read_definition(again, "again")) == again);
        Table t;
        t.quantity = d.quantity;
        for (const std::string& s : d.sweeps)
            t.sweeps.push_back(parse_sweep(s));
        const std::vector<Point> points = all_points(t.sweeps);
        if (points.size() > 200) return 0;
        PointRecord r;
        r.status = "done";
        for (const Point& p : points) {
            AMONTONS_ASSERT(overrides(t.sweeps, p).size() >= t.sweeps.size());
            r.numbers = {{d.quantity, 1.0 / (1 + p.index)}, {"unknowns", double(p.index)}};
            t.rows.push_back(make_row(p, r, d.quantity));
        }
        evaluate(t);
        numbers_of(json_of(t), "table");
        csv_of(t);
        plot_script(t, "study");
        text_of(t);
        tex_of(t);
        parse_shard(d.shard);
    } catch (const InputError&) {
    }
    try {
        read_added(text, "fuzz");
    } catch (const InputError&) {
    }
    try {
        const Numbers n = numbers_of(text, "fuzz");
        for (const auto& [path, value] : n)
            AMONTONS_ASSERT(find(n, path).has_value());
        const Texts t = texts_of(text, "fuzz");
        for (const auto& [path, value] : t)
            AMONTONS_ASSERT(find(t, path).has_value());
        allowed_names(n, t, "energy.eror");
    } catch (const InputError&) {
    }
    return 0;
}
