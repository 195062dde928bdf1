// A free rim of tissue against a closed tool or bone: between its vertices the rim has a face on one side only, so that
// neither vertices in faces nor the sides of faces tell that its edges are inside. Here the middle of what each rim
// edge has inside the body is held outside, as a vertex is. So is that of a fold of a sheet with such a rim, where both
// faces lie on one side of the edge: a sheet that is pushed at its rim folds, and a fold that lies across a round tool
// meets its faces beside the ones that it is deepest under.
#pragma once

#include <cstdint>
#include <vector>

#include "respond/held_contacts.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class RimContacts {
public:
    void prepare(const ThesisState& state);
    /// Notes the rim edges of the tissue triangle contact.b, and the others of a sheet with a free rim, and where they
    /// pass through the face contact.a of a closed body. The triangle may be degenerate.
    void collect(const ThesisState& state, const Frame& frame, const Contact& contact);
    /// After all pairs of the tick: holds what is inside, and what it held in the last tick and is now out by no more
    /// than the resting margin.
    void respond(const ThesisState& state, const Frame& frame, Effect& effect);

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
    void hold(const ThesisState& state, const Frame& frame, EdgePoint point, bool resting, Effect& effect);

    std::vector<std::uint8_t> folds_;   ///< per body: 1 where a free rim lets it fold
    std::vector<EdgePoint> piercings_;  ///< `way` is negative where the edge does not pass through the triangle
    std::vector<EdgePoint> points_;     ///< held in the last tick
    std::vector<EdgePoint> points_now_;
};

}  // namespace trocar
