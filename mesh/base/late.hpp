#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>

namespace amontons {

/// Work that is done once, by the first of several threads that needs it; again if it throws. (A
/// class of its own, since <mutex> would be 2000 lines in every file.)
class Once {
public:
    Once();
    ~Once();
    /// Runs work(of) if no call has completed it yet; returns when it is complete.
    void run(void (*work)(void*), void* of);

private:
    struct Flag;
    std::unique_ptr<Flag> flag_;
};

/// A value that is made at its first use, once, by the first of several threads that needs it.
/// Copies share the value.
template <class Value> class Late {
public:
    /// A value that exists already.
    Late(Value value = {}) : of_(std::make_shared<State>(std::move(value))) {}

    /// @param make  called at most once, and again if it throws
    explicit Late(std::function<Value()> make) : of_(std::make_shared<State>())
    {
        of_->make = std::move(make);
    }

    const Value& operator*() const
    {
        State& s = *of_;
        s.once.run(
            [](void* of) {
                State& own = *static_cast<State*>(of);
                if (!own.make) return;
                own.value = own.make();
                own.make = nullptr; // with what it holds
            },
            &s);
        return *s.value;
    }
    const Value* operator->() const { return &**this; }

private:
    struct State {
        State() = default;
        explicit State(Value known) : value(std::move(known)) {}

        Once once;
        std::function<Value()> make;
        std::optional<Value> value;
    };
    std::shared_ptr<State> of_;
};

} // namespace amontons
