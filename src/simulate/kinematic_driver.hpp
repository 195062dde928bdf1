// Moves kinematic bodies along their scripts and integrates simulated operators with virtual coupling (DESIGN §4,
// METHODS §11). Reports the vertex ranges that moved. Independent of tissue.
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

    /// Before detection: moves every scripted body to its pose at `time`. A body on an operator keeps the operator's
    /// position and takes rotation and jaw from its script. Sets position, previous, velocity, pose and `moved` of the
    /// frame. `tissue_moved`: ascending ranges for `moved`; null: all free tissue.
    void move(double time, const std::vector<Range>* tissue_moved, Frame& frame);

    /// After the response: integrates operators under virtual coupling and contact, and moves their bodies. `reaction`:
    /// load of tissue per body, mean over the tick. Writes the mean load on every body to `load`; moments are about the
    /// world origin. Writes the forces of contacts without tissue to `contact_forces`, one per contact of the output.
    void advance(double time, const ResponseOutput& output, const std::vector<Wrench>& reaction, Frame& frame,
                 std::vector<Wrench>& load, std::span<ContactForce> contact_forces);

    /// Body whose force a row shows (scene.hpp).
    [[nodiscard]] Index shown_body() const { return shown_body_; }
    /// Load of the whole instrument of the shown body; `load` as advance wrote it.
    [[nodiscard]] Wrench shown_load(const std::vector<Wrench>& load) const;
    /// Vertices of kinematic bodies and of free tissue: all that can change in a run. Ranges of free tissue with short
    /// gaps between them are merged.
    [[nodiscard]] const std::vector<Range>& driven_vertices() const { return driven_vertices_; }
    [[nodiscard]] const std::vector<Range>& free_tissue() const { return free_tissue_; }
    /// Operators after the last advance, in the order of their first bodies.
    [[nodiscard]] std::span<const DrivenOperator> operators() const { return driven_; }
    [[nodiscard]] bool has_operator() const { return !operators_.empty(); }
    /// One flag per Topology::body_pairs entry: the pair contains tissue or an operator.
    [[nodiscard]] std::vector<std::uint8_t> yielding_pairs() const;

private:
    /// One operator and its bodies: those of one instrument, or a single one.
    struct Operator {
        std::vector<Index> bodies;  ///< the operator follows the script of the first one
        OperatorState state;
    };

    void find_what_changes();
    void press_scripted(const ResponseOutput& output, const Frame& frame, std::vector<Wrench>& load,
                        std::span<ContactForce> contact_forces) const;
    void place(Index body, const Pose& pose, bool keep_previous, Frame& frame) const;

    const Scene* scene_;
    std::vector<Operator> operators_;
    std::vector<DrivenOperator> driven_;  ///< operators_ as VirtualCouplings takes them
    VirtualCouplings couplings_;
    std::vector<Index> operator_of_body_;   ///< position in operators_, -1 = scripted or fixed
    std::vector<Vector3> operator_motion_;  ///< m, per body: displacement by its operator at the end of the last tick
    std::vector<Pose> last_pose_;
    std::vector<Range> driven_vertices_;
    std::vector<Range> free_tissue_;
    Index shown_body_ = -1;
};

}  // namespace trocar
