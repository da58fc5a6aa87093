#include "solver/step/run_summary.hpp"

#include <algorithm>
#include <string>

namespace amontons {
namespace {

constexpr std::size_t kMostQuantities = 1u << 20, kLongestName = 1u << 12;

void save_text(const std::string& text, ByteWriter& out)
{
    out.vector(std::vector<char>(text.begin(), text.end()));
}

std::string read_text(ByteReader& in)
{
    const std::vector<char> text = in.vector<char>(kLongestName);
    return {text.begin(), text.end()};
}

} // namespace

void add_step(RunSummary& summary, const StepRecord& step)
{
    summary.step_seconds.push_back(step.seconds);
    summary.contacts_max = std::max(summary.contacts_max, int(step.contacts.size()));
    summary.worst_error = std::max(summary.worst_error, step.certificate.error);
    summary.worst_penetration =
        std::max(summary.worst_penetration, step.certificate.worst_penetration);
    if (step.certificate.worst_overlap.depth > summary.worst_overlap.depth)
        summary.worst_overlap = step.certificate.worst_overlap;
    summary.worst_cone_violation =
        std::max(summary.worst_cone_violation, step.certificate.worst_cone_violation);
    if (!step.certificate.certified) ++summary.uncertified_steps;
}

const char* status_of(StepResult::Outcome outcome)
{
    switch (outcome) {
    case StepResult::Outcome::accepted:
        return "running";
    case StepResult::Outcome::done:
        return "done";
    case StepResult::Outcome::failed:
        return "failed";
    case StepResult::Outcome::interrupted:
        break;
    }
    return "interrupted";
}

void save_summary(const RunSummary& summary, ByteWriter& out)
{
    out.value(summary.seconds);
    out.value(summary.contacts_max);
    out.value(summary.worst_error);
    out.value(summary.worst_penetration);
    out.value(summary.worst_cone_violation);
    const OverlapRecord& o = summary.worst_overlap;
    out.value(o.depth);
    save_text(o.a, out);
    save_text(o.b, out);
    for (const double x : o.point)
        out.value(x);
    out.value(o.step);
    out.value(std::uint64_t(summary.warnings.size()));
    for (const std::string& w : summary.warnings)
        save_text(w, out);
    out.value(std::uint64_t(summary.undetermined.size()));
    for (const UndeterminedForce& u : summary.undetermined) {
        save_text(u.a, out);
        save_text(u.b, out);
        for (const double x : {double(u.normal), double(u.tangential), u.min, u.max})
            out.value(x);
    }
    out.value(std::uint64_t(summary.undetermined_not_examined.size()));
    for (const std::string& sentence : summary.undetermined_not_examined)
        save_text(sentence, out);
    out.value(summary.uncertified_steps);
    out.vector(summary.snaps);
    out.vector(summary.step_seconds);
    // Of the last step: a run that was over when it was ended has no other to take them from.
    out.value(std::uint64_t(summary.quantities.size()));
    for (const Quantity& q : summary.quantities) {
        save_text(q.name, out);
        save_text(q.unit, out);
        out.value(q.value);
    }
}

RunSummary read_summary(ByteReader& in)
{
    RunSummary summary;
    summary.seconds = in.value<PhaseSeconds>();
    summary.contacts_max = in.value<int>();
    summary.worst_error = in.value<double>();
    summary.worst_penetration = in.value<double>();
    summary.worst_cone_violation = in.value<double>();
    OverlapRecord& o = summary.worst_overlap;
    o.depth = in.value<double>();
    o.a = read_text(in);
    o.b = read_text(in);
    for (double& x : o.point)
        x = in.value<double>();
    o.step = in.value<int>();
    const auto warnings = in.value<std::uint64_t>();
    if (warnings > kMostQuantities) ByteReader::refuse("an impossible size");
    for (std::uint64_t i = 0; i < warnings; ++i)
        summary.warnings.push_back(read_text(in));
    const auto undetermined = in.value<std::uint64_t>();
    if (undetermined > kMostQuantities) ByteReader::refuse("an impossible size");
    for (std::uint64_t i = 0; i < undetermined; ++i) {
        UndeterminedForce u;
        u.a = read_text(in);
        u.b = read_text(in);
        u.normal = in.value<double>() != 0;
        u.tangential = in.value<double>() != 0;
        u.min = in.value<double>();
        u.max = in.value<double>();
        summary.undetermined.push_back(std::move(u));
    }
    const auto not_examined = in.value<std::uint64_t>();
    if (not_examined > kMostQuantities) ByteReader::refuse("an impossible size");
    for (std::uint64_t i = 0; i < not_examined; ++i)
        summary.undetermined_not_examined.push_back(read_text(in));
    summary.uncertified_steps = in.value<int>();
    summary.snaps = in.vector<SnapRecord>(1u << 24);
    summary.step_seconds = in.vector<double>(1u << 28);
    const auto count = in.value<std::uint64_t>();
    if (count > kMostQuantities) ByteReader::refuse("an impossible size");
    for (std::uint64_t i = 0; i < count; ++i) {
        Quantity q;
        q.name = read_text(in);
        q.unit = read_text(in);
        q.value = in.value<double>();
        summary.quantities.push_back(std::move(q));
    }
    return summary;
}

} // namespace amontons
