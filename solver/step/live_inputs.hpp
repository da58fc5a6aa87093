#pragma once

#include "mesh/base/curve.hpp"
#include "solver/step/byte_stream.hpp"
#include "solver/step/simulation.hpp"

namespace amontons {

/// Curves of a scene that a caller takes over: each becomes the line from where it is to the value
/// that the next step is to end with.
class LiveInputs {
public:
    /// @param curve  outlives this; changed once it is taken over
    /// @param missing  its value while it has no points
    void add(InputInfo info, CurvePoints& curve, double missing = 0);

    /// All inputs, by number.
    const std::vector<InputInfo>& all() const { return info_; }
    /// Value at a time, in the unit of the input.
    double value(std::size_t number, double time) const;
    /// Sets a value from a time on.
    void set(std::size_t number, double value, double time);

    /// Before the length of a step is known: what is led by hand has no knots.
    void begin(double time);
    /// When it is known.
    void lead(double time, double h);
    /// The step was accepted, or is done again in parts: the lines stay.
    void accept();
    /// Which wait for a step; and again, after one that was not taken.
    std::vector<char> waiting() const;
    /// After a step that was not taken: restores which inputs wait for one.
    void wait_again(const std::vector<char>& waiting);

    /// @param layout  the inputs that read() will be asked of: its own, or those of the same
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
