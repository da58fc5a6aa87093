#include "solver/step/overlap_log.hpp"

#include "solver/step/body_step.hpp"
#include "solver/step/byte_stream.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr std::size_t kMostSentences = 8; // of a kind; the others are counted
constexpr double kWorse = 1.5;            // of a pair's overlap: it is reported again
constexpr double kOfIndentation = 0.5;    // more is always reported
constexpr std::size_t kMostPairs = 1u << 20, kPerReport = 4, kPerSize = 8; // numbers

} // namespace

void OverlapLog::add(const BodySystem& system, const BodyStepReport& report, int step,
                     std::vector<std::string>& warnings, bool parted)
{
    for (const ContactSize& now : contact_sizes(system, report, largest))
        largest[now.pair] = now;
    for (const BodyOverlap& o : report.overlaps) {
        bool much = o.depth > o.silent;
        if (const auto size = largest.find(o.pair); size != largest.end())
            much |= o.depth > kOfIndentation * size->second.indentation;
        if (!much) continue;
        double& last = reported[{o.a, o.b, o.obstacle}];
        if (!(o.depth > kWorse * last)) continue;
        last = o.depth;
        if (reported.size() > kMostSentences) continue;
        warnings.push_back(fmt::format("step {}: {}, {}; {} leaves less", step, describe(o, system),
                                       parted ? "after impacts within the step, and were separated "
                                                "without a change of velocity"
                                       : o.depth > o.silent
                                           ? fmt::format("more than {:.3g} m", o.silent)
                                           : "more than half of the indentation",
                                       o.own.count > 0 ? "a finer mesh there" : "a shorter step"));
    }
}

std::vector<std::string> OverlapLog::small_contacts(const BodySystem& system) const
{
    std::vector<std::string> sentences;
    std::size_t more = 0;
    for (const auto& [pair, c] : largest) {
        if (!(c.width < c.face)) continue;
        if (sentences.size() == kMostSentences) {
            ++more;
            continue;
        }
        const ContactPair& p = system.finder.pairs()[std::size_t(pair)];
        sentences.push_back(fmt::format(
            "{} and {}: the contact at ({:.4g}, {:.4g}, {:.4g}) is smaller than a face: about "
            "{:.2g} m wide on faces of {:.2g} m. Its force may be several times too large; use "
            "faces "
            "of half its width",
            system.refs[std::size_t(p.a)].name,
            p.b >= 0 ? system.refs[std::size_t(p.b)].name
                     : system.obstacles[std::size_t(p.obstacle)],
            c.point.x(), c.point.y(), c.point.z(), c.width, c.face));
    }
    if (more > 0)
        sentences.push_back(fmt::format("{} more pairs have contacts smaller than a face", more));
    if (reported.size() > kMostSentences) {
        double worst = 0;
        for (const auto& [key, depth] : reported)
            worst = std::max(worst, depth);
        sentences.push_back(
            fmt::format("{} pairs of bodies overlapped by more than they should, at "
                        "the worst by {:.4g} m",
                        reported.size(), worst));
    }
    return sentences;
}

void OverlapLog::save(ByteWriter& out) const
{
    std::vector<double> reports, sizes;
    for (const auto& [key, depth] : reported)
        reports.insert(reports.end(), {double(key[0]), double(key[1]), double(key[2]), depth});
    for (const auto& [pair, c] : largest)
        sizes.insert(sizes.end(), {double(pair), c.force, c.indentation, c.width, c.face,
                                   c.point.x(), c.point.y(), c.point.z()});
    out.vector(reports);
    out.vector(sizes);
}

OverlapLog OverlapLog::read(ByteReader& in, std::size_t pairs)
{
    const auto reports = in.vector<double>(kPerReport * kMostPairs),
               sizes = in.vector<double>(kPerSize * kMostPairs);
    if (reports.size() % kPerReport != 0 || sizes.size() % kPerSize != 0)
        ByteReader::refuse("an impossible size");
    OverlapLog log;
    for (std::size_t i = 0; i < reports.size(); i += kPerReport)
        log.reported[{int(reports[i]), int(reports[i + 1]), int(reports[i + 2])}] = reports[i + 3];
    for (std::size_t i = 0; i < sizes.size(); i += kPerSize) {
        const double* c = sizes.data() + i;
        if (!(c[0] >= 0 && c[0] < double(pairs))) ByteReader::refuse("a pair of another scene");
        log.largest[int(c[0])] = {int(c[0]), c[1], c[2], c[3], c[4], Vec3(c[5], c[6], c[7])};
    }
    return log;
}

} // namespace amontons
