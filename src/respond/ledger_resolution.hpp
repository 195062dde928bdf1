// Resolution of interpenetration by the crossing ledger (METHODS §9.2): every sample on the wrong side
// pushes the surface it has crossed back past itself by stiff contacts on the faces that it touches, so that what is
// left goes to zero within the settle time, whether the tool moves or not; what cannot be cleared ends as rupture. A
// tear opens at a speed that tissue can follow (1 m/s for the default material): let go all at once, it would fly past
// the tool before the rest of it is in contact.
//
// Pushing along the blended normal at the anchor (anchor=blend) slides a pointed tool across the sheet where hard
// contact catches it in the pocket it has made: against the hard references the force is off by 0.03-0.28 N RMS, with
// the faces' own normals by 0.001-0.03 N. Points on long edges of a tool are samples too (samples=edges): they lie on
// the surface that must come free.
#pragma once

#include <optional>
#include <vector>

#include "respond/approaching_tissue.hpp"
#include "respond/crossing_ledger.hpp"
#include "respond/squeezed_tissue.hpp"
#include "respond/thesis_state.hpp"
#include "respond/torn_tissue.hpp"

namespace trocar {

class LedgerResolution {
public:
    void prepare(const ThesisState& state);
    void respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts,
                 const SqueezedTissue& squeezed, const TornTissue& torn, Effect& effect);
    /// Holds apart what is about to meet tissue, when all that tools do to it is known.
    void keep_apart(const ThesisState& state, const Frame& frame, VelocityChanges& changes, Effect& effect);
    [[nodiscard]] const std::vector<Penetration>& penetrations() const { return ledger_.penetrations(); }
    /// On which side (+1: front) of the tissue around a face of it this triangle belongs, where the ledger knows it of
    /// a corner or of a point on its edges; 0 where one has been given up.
    [[nodiscard]] std::optional<double> side_of(const Topology& topology, const Frame& frame, Index triangle,
                                                Index tissue_face) const;

private:
    [[nodiscard]] static bool gives_up(const ThesisState& state, const Frame& frame, const SqueezedTissue& squeezed,
                                       const TornTissue& torn, Penetration& p);
    void push(const ThesisState& state, const Frame& frame, const Penetration& p, Effect& effect) const;

    CrossingLedger ledger_;
    ApproachingTissue approaching_tissue_;
    std::vector<Penetration> approaching_;
    /// Per body: 1 = anchor=faces counts for what presses on it. Not where tissue presses on tissue: both give way, and
    /// walls between which a sheet is caught make it swing.
    std::vector<std::uint8_t> faces_;
};

}  // namespace trocar
