// What the parts of the response `thesis` share: the run's constants, the working copies of one tick, and the laws that
// more than one part hands over. The parts are contact_reduction (METHODS §5), back_projection (§9.1), held_contacts,
// rim_contacts, approaching_faces and ledger_resolution (§9.2); thesis.cpp has the equations and calls them in order.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "contact/effect.hpp"
#include "respond/common.hpp"
#include "respond/grasp.hpp"
#include "respond/surface.hpp"
#include "respond/thesis_settings.hpp"
#include "respond/tissue_scale.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Working copy of a tissue vertex that a sequential response has changed in this tick.
struct TissueEdit {
    Index vertex = -1;
    Vector3 position = Vector3::Zero();
    Vector3 velocity = Vector3::Zero();
    Index instrument = -1;                      ///< body that takes the reaction, -1 for none
    Vector3 point = Vector3::Zero();            ///< where the reaction acts
    Vector3 normal = Vector3::Zero();           ///< outer normal of the instrument's face
    Vector3 velocity_change = Vector3::Zero();  ///< m/s, sum of the edits that the instrument answers for
    bool held = false;
};

class ThesisState {
public:
    explicit ThesisState(const ThesisSettings& given) : settings(given) {}

    ThesisSettings settings;
    const Topology* topology = nullptr;
    const Materials* materials = nullptr;
    double dt = 0.0;  ///< s, of this tick
    bool has_tissue = false;
    double hard_stiffness = 0.0;     ///< N/m, of constraints
    std::vector<TissueScale> scale;  ///< per body
    PairLaws laws;
    VertexSprings springs;
    SurfaceNeighbours surface;
    Grasp grasp;

    void prepare(const Topology& the_topology, const Materials& the_materials);
    /// Forgets the last tick's edits and asks how hands moved their bodies.
    void begin(const Frame& frame, double the_dt);

    [[nodiscard]] BodyKind kind(Index body) const { return topology->bodies[static_cast<std::size_t>(body)].kind; }
    [[nodiscard]] bool fixed(Index vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        return materials->mass[v] <= 0.0 || materials->pinned[v] != 0;
    }
    [[nodiscard]] bool grasps() const { return has_tissue && settings.grasp != GraspRule::off; }
    /// True when a grasp takes the place of contact between this vertex and body: while tissue follows the tool. On
    /// springs it stays in contact, else it would be drawn through the jaw that it rests on.
    [[nodiscard]] bool follows(Index vertex, Index body) const {
        return has_tissue && settings.grasp == GraspRule::follow && grasp.holds(vertex, body);
    }
    /// Device of the hand that leads a body, if one does.
    [[nodiscard]] const std::optional<Device>& device(Index body) const {
        static const std::optional<Device> none;
        const auto b = static_cast<std::size_t>(body);
        return b < materials->device.size() ? materials->device[b] : none;
    }

    [[nodiscard]] const TissueScale& scale_of(Index tissue) const { return scale[static_cast<std::size_t>(tissue)]; }
    [[nodiscard]] double clear_depth(Index tissue) const { return scale_of(tissue).clear_depth(); }
    /// A depth in this tissue at which it counts as torn, m.
    [[nodiscard]] double deepest(Index tissue) const {
        return std::isnan(settings.d_max) ? 0.25 * scale_of(tissue).side : settings.d_max;
    }
    /// In which tissue that is stretched to its limit would give way if it could, s.
    [[nodiscard]] double patience(Index tissue) const {
        const TissueScale& size = scale_of(tissue);
        return std::max(5.0 * dt, 0.3 * size.side / size.wave_speed);
    }
    /// Time at the strain limit until rupture, s.
    [[nodiscard]] double tear_time(Index tissue) const {
        return std::isnan(settings.tear_time) ? patience(tissue) : settings.tear_time;
    }
    /// Up to this far apart (m) things touch: from rest they do not get further in a tick.
    [[nodiscard]] double touching_gap(Index tissue) const { return 0.25 * clear_depth(tissue); }
    /// How much further (m) than anything gets in a tick one looks, so as not to look again in every tick.
    [[nodiscard]] double look_out(Index tissue) const { return 0.2 * scale_of(tissue).edge; }
    /// Up to this distance (m) what touched a tissue vertex may come back in the next tick.
    [[nodiscard]] double resting_margin(Index vertex) const {
        return scale_of(topology->body_of_vertex(vertex)).margin;
    }

    /// Translation that a hand gave a body in the last tick, m/s; zero for bodies that no hand leads.
    [[nodiscard]] const Vector3& hand_velocity(Index body) const {
        return hand_velocity_[static_cast<std::size_t>(body)];
    }

    // Working copies.
    [[nodiscard]] const std::vector<TissueEdit>& edits() const { return edits_; }
    [[nodiscard]] Vector3 velocity(const Frame& frame, Index vertex) const {
        const Index slot = slot_[static_cast<std::size_t>(vertex)];
        return slot < 0 ? Vector3(frame.velocity.col(vertex)) : edits_[static_cast<std::size_t>(slot)].velocity;
    }
    TissueEdit& edit(const Frame& frame, Index vertex);
    /// Springs, damping, drag and rest bias on a vertex, N, all vertices where this response has put them.
    [[nodiscard]] Vector3 internal_force_on(const Frame& frame, const TissueEdit& vertex) const;

    // Laws.
    /// Stiffness of a penalty contact, N/m: the method's, the scene's, else the profile's. `on_tissue` is the mean of
    /// springs that the equation names; `vertex` the one whose area counts.
    [[nodiscard]] double stiffness(Index body_a, Index body_b, double on_tissue, Index vertex) const;
    /// A stiff contact that clears `depth` (m) within the settle time; never pulls. Deep ones are for clear_slowly.
    [[nodiscard]] LinearContact hard_contact(double depth) const;
    /// With what tissue weighs, k d of a deep contact would throw it: its depth counts as what clear_speed clears. The
    /// contact acts on tissue.
    void clear_slowly(LinearContact& linear) const;
    /// A gap is the frame's, where a body that follows a script has already moved while the tissue is a tick behind,
    /// and changes with the face's velocity from there. Taken back to where the face came from, it closes at the end of
    /// the tick where the face is, not one tick's motion beyond it. The step of a body led by a hand comes after the
    /// tissue's: of its motion only the turn is the script's. Tissue moves together with the tissue that it meets.
    /// `rate` gives the face velocity (m/s, along the contact's normal) for a velocity of the face.
    template <typename Rate>
    void end_on_time(Index face_body, const Vector3& velocity_of_face, const Rate& rate, LinearContact& linear) const {
        linear.face_velocity = rate(velocity_of_face);
        if (kind(face_body) != BodyKind::tissue) {
            linear.gap += rate(Vector3(velocity_of_face - hand_velocity(face_body))) * dt;
        }
        clear_slowly(linear);
    }
    /// Coulomb friction with a tangential spring (METHODS §6, option): `surface_velocity` is the other side's, `key`
    /// the vertex that is in contact, or a number from the vertex count on for another point.
    void rub(Index key, const Vector3& surface_velocity, LinearContact& linear) const;
    /// Appends a penalty contact whose gap the equation gives at the frame: clamped, or as it is.
    void finish(const Frame& frame, LinearContact linear, Effect& effect) const;

private:
    std::vector<Index> slot_;  ///< N; position in edits_, -1 for none
    std::vector<TissueEdit> edits_;
    std::vector<Vector3> hand_velocity_;  ///< m/s, per body, of this tick
};

}  // namespace trocar
