// What the parts of the response `thesis` share: the run's constants, the working copies of one tick, and the laws that
// more than one part hands over. Kept from tick to tick are the grasp and, in TipProxies, the places of the proxies;
// all else is of one tick.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/response_output.hpp"
#include "respond/common.hpp"
#include "respond/contact_laws.hpp"
#include "respond/grasp.hpp"
#include "respond/surface.hpp"
#include "respond/thesis_settings.hpp"
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
    ContactLaws laws;
    VertexSprings springs;
    SurfaceNeighbours surface;
    Grasp grasp;

    void prepare(const Topology& the_topology, const Materials& the_materials);
    /// Forgets the last tick's edits.
    void begin(const Frame& frame, double the_dt);

    [[nodiscard]] BodyKind kind(Index body) const { return topology->bodies[static_cast<std::size_t>(body)].kind; }
    [[nodiscard]] bool fixed(Index vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        return materials->mass[v] <= 0.0 || materials->pinned[v] != 0;
    }
    /// True when a grasp takes the place of contact between this vertex and body: while tissue follows the tool. On
    /// the springs of `corrected` it stays in contact, else it would be drawn through the jaw that it rests on.
    [[nodiscard]] bool follows(Index vertex, Index body) const {
        return has_tissue && !settings.corrected() && grasp.holds(vertex, body);
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
    /// Appends a penalty contact whose gap the equation gives at the frame: clamped, or as it is.
    void finish(const Frame& frame, ContactForceLaw linear, ResponseOutput& output) const;

private:
    std::vector<Index> slot_;  ///< N; position in edits_, -1 for none
    std::vector<TissueEdit> edits_;
};

}  // namespace trocar
