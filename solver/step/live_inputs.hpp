#pragma once

#include "mesh/base/curve.hpp"
#include "solver/step/byte_stream.hpp"
#include "solver/step/simulation.hpp"

#include <algorithm>

namespace amontons {

/// Curves of a scene that a caller prescribes step by step: each becomes the line from its present
/// value to the value at the end of the next step.
class LiveInputs {
public:
    /// Adds an input.
    /// @param curve    outlives this; replaced by a line once a value is set
    /// @param missing  its value while it has no points
    void add(InputInfo info, CurvePoints& curve, double missing = 0);

    /// All inputs, by number.
    const std::vector<InputInfo>& all() const { return info_; }
    /// True if a caller has set one.
    bool some_live() const
    {
        return std::ranges::any_of(input_, [](const Input& i) { return i.live || i.waiting; });
    }
    /// Value at a time, in the unit of the input. @throws InputError  no such input
    double value(std::size_t number, double time) const;
    /// Sets a value from a time on. @throws InputError  no such input, or a value out of its range
    void set(std::size_t number, double value, double time);

    /// Before the length of a step is known: removes the knots of prescribed inputs.
    /// @param time  start of the step [s]
    void begin(double time);
    /// When it is known: makes the lines from `time` to `time` + h [s].
    void lead(double time, double h);
    /// To be called when the step was accepted, or is repeated in parts: the lines stay.
    void accept();
    /// Of each input: has it a value that waits for the next step?
    std::vector<char> waiting() const;
    /// After a step that was not accepted: restores waiting().
    void wait_again(const std::vector<char>& waiting);

    /// @param layout  the inputs that read() will return: its own, or those of the same
    ///                simulation with other holds and loads
    void save(ByteWriter& out, const LiveInputs& layout) const;
    /// The state of one input.
    struct Saved {
        /// Set by a caller; waiting for its first value.
        bool live = false, waiting = false;
        /// In the unit of the input.
        double value = 0;
        double start[2] = {}, end[2] = {}; ///< time [s] and value; of live ones
    };
    /// Reads saved values.
    std::vector<Saved> read(ByteReader& in) const;
    /// Restores saved values.
    void restore(const std::vector<Saved>& saved);

private:
    struct Input {
        CurvePoints* curve = nullptr;
        double missing = 0;
        CurvePoints of_scene;
        bool live = false;
        bool waiting = false; ///< for the next step, whose end is to have `target`
        double target = 0;
    };
    const Input& at(std::size_t number) const;
    static double now(const Input& input, double time);

    std::vector<InputInfo> info_;
    std::vector<Input> input_;
};

} // namespace amontons
