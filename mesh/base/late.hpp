#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

namespace amontons {

/// A value that is made when it is first asked for, once, whichever of several threads asks first.
/// Copies are of the same value.
template <class Value> class Late {
public:
    /// One that is there.
    Late(Value value = {}) : of_(std::make_shared<State>(std::move(value))) {}

    /// @param make  called at most once, and again if it throws
    explicit Late(std::function<Value()> make) : of_(std::make_shared<State>())
    {
        of_->make = std::move(make);
    }

    const Value& operator*() const
    {
        State& s = *of_;
        std::call_once(s.once, [&s] {
            if (!s.make) return;
            s.value = s.make();
            s.make = nullptr; // with what it holds
        });
        return *s.value;
    }
    const Value* operator->() const { return &**this; }

private:
    struct State {
        State() = default;
        explicit State(Value known) : value(std::move(known)) {}

        std::once_flag once;
        std::function<Value()> make;
        std::optional<Value> value;
    };
    std::shared_ptr<State> of_;
};

} // namespace amontons
