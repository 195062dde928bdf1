// Edges of tissue against a closed tool or bone where neither vertices in faces nor the sides of faces tell that they
// are inside: a free rim, which has a face on one side only, and a fold, where both faces lie on one side of the edge.
// A sheet folds where it is pushed at its rim, and over the point of a needle that is dragged; a fold that lies across
// a round tool meets its faces beside the ones that it is deepest under. Here the middle of what each such edge has
// inside the body is held outside, as a vertex is.
#pragma once

#include <cstdint>
#include <vector>

#include "respond/held_contacts.hpp"
#include "respond/ledger_resolution.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class RimContacts {
public:
    void prepare(const ThesisState& state);
    /// Notes the edges of the tissue triangle contact.b and where they pass through the face contact.a of a closed
    /// body. The triangle may be degenerate.
    void collect(const ThesisState& state, const Frame& frame, const Contact& contact);
    /// After all pairs of the tick: holds what is inside, and what it held in the last tick and is now out by no more
    /// than the resting margin. `ledger`: what knows of crossings, null without.
    void respond(const ThesisState& state, const Frame& frame, const LedgerResolution* ledger, Effect& effect);

private:
    /// A point of an edge u < v.
    struct EdgePoint {
        Index u = -1;
        Index v = -1;
        Index body = -1;
        double way = 0.0;     ///< of the edge's length, from u
        Index triangle = -1;  ///< of the body
        bool on_rim = false;
        [[nodiscard]] bool is_of_edge(const EdgePoint& other) const {
            return u == other.u && v == other.v && body == other.body;
        }
        [[nodiscard]] Vector3 of(const Matrix3X& columns) const {
            return (1.0 - way) * columns.col(u) + way * columns.col(v);
        }
    };
    [[nodiscard]] bool is_loose(const ThesisState& state, const EdgePoint& point) const;
    [[nodiscard]] bool is_fold(const ThesisState& state, const Frame& frame, const EdgePoint& point,
                               const Vector3& outwards) const;
    [[nodiscard]] bool may_leave(const ThesisState& state, const Frame& frame, const LedgerResolution* ledger,
                                 const EdgePoint& point, const Vector3& outwards) const;
    void hold(const ThesisState& state, const Frame& frame, const LedgerResolution* ledger, EdgePoint point,
              bool resting, Effect& effect);

    std::vector<std::uint8_t> loose_;   ///< per body: 1 = tissue with a free rim
    std::vector<EdgePoint> piercings_;  ///< `way` is negative where the edge does not pass through the triangle
    std::vector<EdgePoint> points_;     ///< held in the last tick
    std::vector<EdgePoint> points_now_;
};

}  // namespace trocar
