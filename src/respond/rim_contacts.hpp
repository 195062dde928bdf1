// A free rim of tissue against a closed tool or bone: between its vertices the rim has a face on one side only, so that
// neither vertices in faces nor the sides of faces tell that its edges are inside. Here the middle of what each rim
// edge has inside the body is held outside, as a vertex is.
#pragma once

#include <vector>

#include "respond/held_contacts.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class RimContacts {
public:
    void prepare();
    /// Notes where rim edges of the tissue triangle contact.b pass through the face contact.a of a closed body.
    void collect(const ThesisState& state, const Frame& frame, const Contact& contact);
    /// After all pairs of the tick: holds what is inside, and what it held in the last tick and is now out by no more
    /// than the resting margin.
    void respond(const ThesisState& state, const Frame& frame, Effect& effect);

private:
    /// A rim edge u < v passes through a face.
    struct Piercing {
        Index u = -1;
        Index v = -1;
        Index body = -1;
        double way = 0.0;  ///< of the edge's length, from u
        Index triangle = -1;
    };
    /// A point of a rim edge that is held.
    struct RimPoint {
        Index u = -1;
        Index v = -1;
        Index body = -1;
        double way = 0.0;
        Index triangle = -1;  ///< of the body
        [[nodiscard]] Vector3 of(const Matrix3X& columns) const {
            return (1.0 - way) * columns.col(u) + way * columns.col(v);
        }
    };
    void hold(const ThesisState& state, const Frame& frame, RimPoint point, bool resting, Effect& effect);

    std::vector<Piercing> piercings_;
    std::vector<RimPoint> points_;  ///< held in the last tick
    std::vector<RimPoint> points_now_;
};

}  // namespace trocar
