#include "solver/step/live_inputs.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons {

void LiveInputs::add(InputInfo info, CurvePoints& curve, double missing)
{
    info_.push_back(std::move(info));
    input_.push_back({&curve, missing, curve, false, false, 0});
}

const LiveInputs::Input& LiveInputs::at(std::size_t number) const
{
    if (number < input_.size()) return input_[number];
    throw InputError({{"", fmt::format("input {}", number), "no such input",
                       input_.empty() ? "none" : fmt::format("0 to {}", input_.size() - 1)}});
}

double LiveInputs::now(const Input& input, double time)
{
    return input.curve->empty() ? input.missing : curve_value(*input.curve, time);
}

double LiveInputs::value(std::size_t number, double time) const
{
    const Input& k = at(number);
    return k.waiting ? k.target : now(k, time);
}

void LiveInputs::set(std::size_t number, double value, double time)
{
    at(number);
    const InputInfo& info = info_[number];
    if (!(value >= info.lower && value <= info.upper) || !std::isfinite(value))
        throw InputError({{"", info.name, fmt::format("{}", value),
                           fmt::format("a finite number >= {} and <= {} [{}]", info.lower,
                                       info.upper, info.unit)}});
    Input& k = input_[number];
    const double from = now(k, time);
    *k.curve = {{time, from}, {time, from}};
    k.live = k.waiting = true;
    k.target = value;
}

void LiveInputs::begin(double time)
{
    for (Input& k : input_)
        if (k.waiting) {
            const double from = now(k, time);
            *k.curve = {{time, from}, {time, from}};
        }
}

void LiveInputs::lead(double time, double h)
{
    for (Input& k : input_)
        if (k.waiting) (*k.curve)[1] = {time + h, k.target};
}

void LiveInputs::accept()
{
    for (Input& k : input_)
        k.waiting = false;
}

std::vector<char> LiveInputs::waiting() const
{
    std::vector<char> all;
    for (const Input& k : input_)
        all.push_back(k.waiting);
    return all;
}

void LiveInputs::wait_again(const std::vector<char>& waiting)
{
    for (std::size_t i = 0; i < input_.size(); ++i)
        input_[i].waiting = waiting[i] != 0;
}

void LiveInputs::save(ByteWriter& out, const LiveInputs& layout) const
{
    for (const InputInfo& expected : layout.info_) {
        const auto at = std::ranges::find(info_, expected.name, &InputInfo::name);
        if (at == info_.end()) {
            out.value(false);
            continue;
        }
        const Input& k = input_[std::size_t(at - info_.begin())];
        out.value(k.live);
        if (!k.live) continue;
        out.value(k.waiting);
        out.value(k.target);
        for (const auto& point : *k.curve)
            for (const double v : point)
                out.value(v);
    }
}

std::vector<LiveInputs::Saved> LiveInputs::read(ByteReader& in) const
{
    std::vector<Saved> all;
    for (std::size_t i = 0; i < input_.size(); ++i) {
        Saved& s = all.emplace_back();
        s.live = in.value<bool>();
        if (!s.live) continue;
        s.waiting = in.value<bool>();
        s.value = in.value<double>();
        for (double* point : {s.start, s.end})
            for (int k = 0; k < 2; ++k)
                point[k] = in.value<double>();
        if (!(s.start[0] <= s.end[0]) || !std::isfinite(s.value + s.start[1] + s.end[1]))
            ByteReader::refuse("an impossible input");
    }
    return all;
}

void LiveInputs::restore(const std::vector<Saved>& saved)
{
    for (std::size_t i = 0; i < input_.size(); ++i) {
        Input& k = input_[i];
        const Saved& s = saved[i];
        k.live = s.live;
        k.waiting = s.waiting;
        k.target = s.value;
        *k.curve =
            s.live ? CurvePoints{{s.start[0], s.start[1]}, {s.end[0], s.end[1]}} : k.of_scene;
    }
}

} // namespace amontons
