// Resolution of interpenetration by the crossing ledger (METHODS §9.2, corrected): every vertex on the wrong side
// pushes the surface it has crossed back past itself by a stiff contact on the anchor, so that what is left goes to
// zero within the settle time, whether the tool moves or not; what cannot be cleared ends as rupture.
#pragma once

#include <vector>

#include "respond/crossing_ledger.hpp"
#include "respond/squeezed_tissue.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class LedgerResolution {
public:
    void prepare(const Topology& topology);
    void respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts,
                 const SqueezedTissue& squeezed, Effect& effect);
    [[nodiscard]] const std::vector<Penetration>& penetrations() const { return ledger_.penetrations(); }
    /// True when the ledger knows of a corner of this triangle which way is out.
    [[nodiscard]] bool knows_corner(const Topology& topology, Index triangle) const;

private:
    [[nodiscard]] static bool gives_up(const ThesisState& state, const Frame& frame, const SqueezedTissue& squeezed,
                                       Penetration& p);

    CrossingLedger ledger_;
    std::vector<std::uint8_t> inside_;  ///< N; 1 = in the ledger
};

}  // namespace trocar
