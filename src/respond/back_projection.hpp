// Velocity back-projection of thesis §3.4.5, as specified in METHODS §9.1: a path from each instrument vertex back
// along its velocity. The instrument vertex and the tissue vertices at the crossed surfaces attract each other. The
// surfaces are those that the detector pairs with the instrument. Limits: no effect for a tool at rest, wrong direction
// on withdrawal.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class BackProjection {
public:
    void respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts, ResponseOutput& output);

private:
    /// A tissue triangle that the detector pairs with an instrument.
    struct Met {
        Index body = -1;  ///< instrument
        Index triangle = -1;
        Box box = {};
    };
    void collect_met(const ThesisState& state, const Frame& frame, const ContactSet& contacts);
    void attract(const ThesisState& state, const Frame& frame, Index vertex, const Vector3& from, const Met& met,
                 ResponseOutput& output);

    std::vector<Met> met_;  ///< sorted by body and triangle
    std::vector<Index> attracted_;
};

}  // namespace trocar
