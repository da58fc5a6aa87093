#include "bindings/python/stepper.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

// Many simulations on threads of C++: each by itself, so that their number and the order in which
// they come change nothing.

namespace amontons::python {
namespace {

using Outcome = StepResult::Outcome;
using BatchNumbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using BatchMask = py::array_t<bool, py::array::c_style | py::array::forcecast>;

enum class Moved : std::int8_t { moved = 0, at_end = 1, failed = 2 };

class Batch : public std::enable_shared_from_this<Batch> {
public:
    /// With the GIL; the simulations are of one user: this.
    Batch(std::vector<std::shared_ptr<Stepper>> members, int threads)
        : members_(std::move(members))
        , threads_(threads)
        , pending_(members_.size(), 0)
        , messages_(members_.size())
    {
    }

    /// Held by each call: one thread at a time, also of each simulation.
    class Use {
    public:
        explicit Use(Batch& b)
        {
            for (const auto& s : b.members_)
                held_.push_back(std::make_unique<Stepper::Use>(*s, Stepper::Purpose::change));
        }

    private:
        std::vector<std::unique_ptr<Stepper::Use>> held_;
    };

    const std::vector<std::shared_ptr<Stepper>>& members() const { return members_; }
    std::vector<std::string>& messages() { return messages_; }

    /// Each of those that are chosen continues by so many seconds. Without the GIL.
    std::vector<Moved> advance(double seconds, const std::vector<char>& chosen)
    {
        const auto all = std::make_shared<std::vector<Moved>>(members_.size(), Moved::moved);
        const auto stop = std::make_shared<std::atomic<bool>>(false);
        const auto work = [self = shared_from_this(), all, stop, seconds, chosen] {
            self->for_each([&](std::size_t i) {
                if (chosen[i]) (*all)[i] = self->move(i, seconds, *stop);
            });
        };
        wait_for(Aside::start(work, stop), members_);
        return *all;
    }

    /// Calls `work` for each member, shared out to the threads.
    template <class Work> void for_each(const Work& work)
    {
        std::atomic<std::size_t> next{0};
        std::exception_ptr failure;
        std::atomic<bool> failed{false};
        const auto take = [&] {
            for (std::size_t i; (i = next++) < members_.size() && !failed;)
                try {
                    work(i);
                } catch (...) {
                    if (!failed.exchange(true)) failure = std::current_exception();
                }
        };
        const std::size_t count = std::min(std::size_t(threads_), members_.size());
        std::vector<std::thread> others;
        for (std::size_t k = 1; k < count; ++k)
            others.emplace_back(take);
        take();
        for (std::thread& t : others)
            t.join();
        if (failure) std::rethrow_exception(failure);
    }
    void note_times()
    {
        for (std::size_t i = 0; i < members_.size(); ++i) {
            pending_[i] = members_[i]->simulation().so_far().time;
            messages_[i].clear();
        }
    }

private:
    Moved move(std::size_t i, double seconds, const std::atomic<bool>& stop)
    {
        Stepper& s = *members_[i];
        messages_[i].clear();
        if (!s.record()) {
            const StepResult first = s.step(stop, std::numeric_limits<double>::infinity());
            if (first.outcome != Outcome::accepted) return refused(i, first);
        }
        const double end = s.end(), until = std::min(pending_[i] + seconds, end);
        StepResult last;
        while ((last = s.step(stop, until)).outcome == Outcome::accepted) {
        }
        if (last.outcome != Outcome::done) return refused(i, last);
        pending_[i] = until;
        return s.done() ? Moved::at_end : Moved::moved;
    }
    Moved refused(std::size_t i, const StepResult& last)
    {
        pending_[i] = members_[i]->simulation().so_far().time;
        messages_[i] = last.message;
        return Moved::failed;
    }

    std::vector<std::shared_ptr<Stepper>> members_;
    int threads_;
    std::vector<double> pending_; ///< times that each has been led to [s]
    std::vector<std::string> messages_;
};

py::array quantity(Batch& b, const std::string& name, const py::object& out)
{
    const Batch::Use use(b);
    py::array_t<double> values =
        out_array<double>(out, "doubles", {py::ssize_t(b.members().size())});
    double* to = values.mutable_data();
    for (const auto& s : b.members()) {
        if (!s->record())
            throw_runtime("no quantities before the first advance(); advance(0) takes the state at "
                          "the start");
        const std::vector<Quantity>& all = s->record()->step.quantities;
        const auto at = std::ranges::find(all, name, &Quantity::name);
        if (at == all.end()) {
            std::vector<std::string> names;
            for (const Quantity& q : all)
                names.push_back(q.name);
            const std::string near = nearest_name(name, names);
            throw InputError(
                {{"", "quantity", quoted_text(name),
                  near.empty() ? "a column of history.csv" : "nearest name: \"" + near + "\""}});
        }
        *to++ = at->value;
    }
    return values;
}

/// Points of a line, spread by arc length from its tip (its last point).
void spread_from_tip(const std::vector<Vec3>& points, py::ssize_t count, double* out)
{
    double length = 0;
    for (std::size_t i = 1; i < points.size(); ++i)
        length += (points[i] - points[i - 1]).norm();
    std::size_t i = points.size() - 1;
    double passed = 0; // from the tip to points[i]
    for (py::ssize_t k = 0; k < count; ++k) {
        const double at = count > 1 ? length * double(k) / double(count - 1) : 0;
        while (i > 0 && passed + (points[i] - points[i - 1]).norm() < at) {
            passed += (points[i] - points[i - 1]).norm();
            --i;
        }
        Vec3 x = points[i];
        if (i > 0) {
            const Vec3 d = points[i - 1] - points[i];
            if (d.norm() > 0) x += std::min(1.0, (at - passed) / d.norm()) * d;
        }
        for (int a = 0; a < 3; ++a)
            *out++ = x[a];
    }
}

py::array points(Batch& b, const std::string& body, py::ssize_t count, const py::object& out)
{
    const Batch::Use use(b);
    if (count < 1 || count > 1 << 20)
        throw InputError({{"", "count", std::to_string(count), "1 to 1048576"}});
    const auto n = py::ssize_t(b.members().size());
    py::array_t<double> values = out_array<double>(out, "doubles", {n, count, 3});
    double* to = values.mutable_data();
    for (const auto& s : b.members()) {
        if (!s->record()) throw_runtime("no points before the first advance()");
        const std::vector<BeamRecord>& all = s->record()->step.beams;
        const auto at = std::ranges::find(all, body, &BeamRecord::name);
        if (at == all.end() || at->points.empty())
            throw InputError({{"", "body", quoted_text(body), "the name of a beam or rod"}});
        spread_from_tip(at->points, count, to);
        to += 3 * count;
    }
    return values;
}

std::vector<char> chosen_of(const Batch& b, const py::object& where)
{
    std::vector<char> all(b.members().size(), 1);
    if (where.is_none()) return all;
    const BatchMask mask = BatchMask::ensure(where);
    if (!mask || mask.ndim() != 1 || mask.size() != py::ssize_t(all.size())) {
        PyErr_Clear();
        throw InputError({{"", "where", "another shape",
                           "(" + std::to_string(all.size()) + ",) of true or false"}});
    }
    std::copy(mask.data(), mask.data() + mask.size(), all.begin());
    return all;
}

py::array advance_batch(Batch& b, double seconds, const py::object& where)
{
    const Batch::Use use(b);
    if (!(seconds >= 0) || !std::isfinite(seconds))
        throw InputError({{"", "seconds", std::to_string(seconds), "finite, >= 0 [s]"}});
    const std::vector<char> chosen = chosen_of(b, where);
    std::vector<Moved> all;
    {
        const py::gil_scoped_release free;
        all = b.advance(seconds, chosen);
    }
    return py::array_t<std::int8_t>(py::ssize_t(all.size()),
                                    reinterpret_cast<const std::int8_t*>(all.data()));
}

/// Sets all inputs that are not as they were reported last: none, if one is not possible.
void set_inputs(Batch& b, const BatchNumbers& now, const BatchNumbers& given,
                const py::object& where)
{
    const Batch::Use use(b);
    const std::vector<char> chosen = chosen_of(b, where);
    for (const bool only_check : {true, false})
        for (std::size_t i = 0; i < b.members().size(); ++i) {
            if (!chosen[i]) continue;
            Simulation& s = b.members()[i]->simulation();
            for (std::size_t k = 0; k < s.inputs().size(); ++k) {
                const double v = now.at(i, k);
                if (v == given.at(i, k)) continue;
                const InputInfo& info = s.inputs()[k];
                if (only_check && !(std::isfinite(v) && v >= info.lower && v <= info.upper))
                    throw InputError(
                        {{"", "inputs[" + std::to_string(i) + "]: " + info.name, std::to_string(v),
                          "a finite number >= " + std::to_string(info.lower) +
                              " and <= " + std::to_string(info.upper) + " [" + info.unit + "]"}});
                if (!only_check) s.set_input(k, v);
            }
        }
}

void get_inputs(Batch& b, py::array_t<double, py::array::c_style> out)
{
    const Batch::Use use(b);
    double* to = out.mutable_data();
    for (const auto& s : b.members())
        for (std::size_t k = 0; k < s->simulation().inputs().size(); ++k)
            *to++ = s->simulation().input(k);
}

} // namespace

void add_batch(py::module_& module)
{
    py::class_<Batch, std::shared_ptr<Batch>>(module, "Batch", py::module_local())
        .def(py::init<std::vector<std::shared_ptr<Stepper>>, int>())
        .def("advance", advance_batch)
        .def("quantity", quantity)
        .def("points", points)
        .def("set_inputs", set_inputs)
        .def("get_inputs", get_inputs)
        .def("note_times",
             [](Batch& b) {
                 const Batch::Use use(b);
                 b.note_times();
             })
        .def_property_readonly("messages", [](Batch& b) {
            const Batch::Use use(b);
            return b.messages();
        });
}

} // namespace amontons::python
