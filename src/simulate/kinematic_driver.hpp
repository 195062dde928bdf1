// Who leads the bodies of a scene: scripts that are followed exactly, and simulated operators that contact pushes back
// (DESIGN §4, METHODS §11). Moves vertices and says which ranges moved; knows no tissue.
#pragma once

#include <span>
#include <vector>

#include "contact/response_output.hpp"
#include "scene/scene.hpp"
#include "tissue/virtual_coupling.hpp"

namespace trocar {

class KinematicDriver {
public:
    /// The scene outlives the object.
    explicit KinematicDriver(const Scene& scene);

    /// Before detection: every scripted body goes to its pose at `time`; a body led by an operator stays where the
    /// operator is and takes rotation and jaw from its script. Sets position, previous, velocity, pose and `moved` of
    /// the frame: of the tissue `tissue_moved`, ascending; null: all that can move.
    void move(double time, const std::vector<Range>* tissue_moved, Frame& frame);

    /// After the response: operators move under hand and contact, and their bodies with them. `reaction` holds what
    /// tissue gave back per body (mean over the tick). Writes the mean load on every body to `load`; moments are about
    /// the world origin. Writes to `contact_forces`, one per contact of the output, what contacts without tissue gave.
    void advance(double time, const ResponseOutput& output, const std::vector<Wrench>& reaction, Frame& frame,
                 std::vector<Wrench>& load, std::span<ContactForce> contact_forces);

    /// The first instrument that has a motion, else the first instrument, else -1: whose force a row shows.
    [[nodiscard]] Index shown_body() const { return shown_body_; }
    /// Sum over the bodies of the instrument that the shown body belongs to, from what advance wrote.
    [[nodiscard]] Wrench shown_load(const std::vector<Wrench>& load) const;
    /// Vertices of led bodies, and tissue vertices that are not held (runs with short gaps between them are one): all
    /// that can change in a run.
    [[nodiscard]] const std::vector<Range>& driven_vertices() const { return driven_vertices_; }
    [[nodiscard]] const std::vector<Range>& free_tissue() const { return free_tissue_; }
    /// What became of every hand in the last advance: one per operator, in the order of their first bodies.
    [[nodiscard]] std::span<const DrivenOperator> operators() const { return driven_; }
    [[nodiscard]] bool has_operator() const { return !operators_.empty(); }
    /// One flag per Topology::body_pairs entry: tissue or a hand is in the pair.
    [[nodiscard]] std::vector<std::uint8_t> yielding_pairs() const;

private:
    /// Bodies led by one hand: those of one instrument, or a single one.
    struct Operator {
        std::vector<Index> bodies;  ///< the first one has the script that the hand follows
        OperatorState state;
    };

    void find_what_changes();
    void press_scripted(const ResponseOutput& output, const Frame& frame, std::vector<Wrench>& load,
                        std::span<ContactForce> contact_forces) const;
    void place(Index body, const Pose& pose, bool keep_previous, Frame& frame) const;

    const Scene* scene_;
    std::vector<Operator> operators_;
    std::vector<DrivenOperator> driven_;  ///< of operators_, for one tick
    VirtualCouplings couplings_;
    std::vector<Index> operator_of_body_;   ///< position in operators_, -1 = scripted or fixed
    std::vector<Vector3> operator_motion_;  ///< m, per body: what its hand moved it at the end of the last tick
    std::vector<Pose> last_pose_;
    std::vector<Range> driven_vertices_;
    std::vector<Range> free_tissue_;
    Index shown_body_ = -1;
};

}  // namespace trocar
