// How much faster than in the frame tissue may come to move within the tick: what is about to meet has to be found by
// that, too.
#pragma once

#include <cstdint>
#include <vector>

#include "respond/thesis_state.hpp"

namespace trocar {

class VelocityChanges {
public:
    void prepare(const ThesisState& state);
    /// Both outlive the tick.
    void begin_tick(const ThesisState& state, const Frame& frame);
    /// Takes note of all that pushes tissue in this tick up to now, anew at each call.
    void note(const Effect& effect);
    /// m/s, of a vertex of tissue: it may come to move like its neighbours, and what pushes it or them gives them its
    /// own speed and that at which it clears the depth.
    [[nodiscard]] double at(Index vertex);
    /// The same where nothing that touches the vertex holds it: then the springs' force moves it, too.
    [[nodiscard]] double when_free(Index vertex);
    /// m/s: no vertex of the body gets faster in the tick.
    [[nodiscard]] double fastest(Index body);

private:
    struct Fastest {
        std::int64_t asked_at = 0;  ///< tick
        double speed = 0.0;         ///< m/s
    };

    const ThesisState* state_ = nullptr;
    const Frame* frame_ = nullptr;
    std::int64_t tick_ = 0;
    std::int64_t notes_ = 0;      ///< calls of note
    double largest_push_ = 0.0;   ///< m/s
    std::vector<double> pushed_;  ///< m/s, per vertex
    std::vector<Index> with_push_;
    std::vector<double> change_;          ///< m/s, per vertex, where it has been asked for
    std::vector<std::int64_t> held_at_;   ///< per vertex, the last notes_ that saw something that touches it hold it
    std::vector<std::int64_t> asked_at_;  ///< per vertex, notes_
    std::vector<Fastest> fastest_;        ///< per body
};

}  // namespace trocar
