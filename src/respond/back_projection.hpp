// Velocity back-projection of thesis §3.4.5 as METHODS §9.1 makes it executable: from each instrument vertex back along
// its velocity; tissue vertices at the surfaces it has passed attract it and are attracted. The surfaces are those that
// the detector says meet the instrument. Says nothing for a tool at rest, and on withdrawal looks the wrong way.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class BackProjection {
public:
    void respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts, ResponseOutput& output);

private:
    /// A tissue triangle that meets an instrument.
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
