// State shared by the parts of the response `thesis`: constants of the run, working copies of one tick, common laws.
// Only the grasp and the positions of TipProxies persist between ticks.
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

/// Working copy of a tissue vertex that a response has changed in this tick.
struct TissueEdit {
    Index vertex = -1;
    Vector3 position = Vector3::Zero();
    Vector3 velocity = Vector3::Zero();
    Index instrument = -1;                      ///< body that takes the reaction; -1: none
    Vector3 point = Vector3::Zero();            ///< where the reaction acts
    Vector3 normal = Vector3::Zero();           ///< outer normal of the instrument's face
    Vector3 velocity_change = Vector3::Zero();  ///< m/s, sum of the edits with a reaction on the instrument
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
    /// Discards the last tick's edits.
    void begin(const Frame& frame, double the_dt);

    [[nodiscard]] BodyKind kind(Index body) const { return topology->bodies[static_cast<std::size_t>(body)].kind; }
    [[nodiscard]] bool fixed(Index vertex) const { return !materials->is_free(vertex); }
    /// True if a grasp replaces contact between this vertex and body. In `corrected` grasped tissue stays in contact,
    /// since its springs would otherwise draw it through the jaw.
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
    /// N, from springs, damping, drag and rest bias on a vertex, with all edits of this tick applied.
    [[nodiscard]] Vector3 internal_force_on(const Frame& frame, const TissueEdit& vertex) const;

    // Laws.
    /// N/m, of a penalty contact: the method's value, else the scene's, else the profile's. `on_tissue`: mean of
    /// springs of the equation; `vertex`: the vertex whose area counts.
    [[nodiscard]] double stiffness(Index body_a, Index body_b, double on_tissue, Index vertex) const;
    /// Appends a penalty contact whose gap the equation gives at the frame. `corrected` clamps its force.
    void finish(const Frame& frame, ContactForceLaw linear, ResponseOutput& output) const;

private:
    std::vector<Index> slot_;  ///< N; position in edits_, -1 for none
    std::vector<TissueEdit> edits_;
};

}  // namespace trocar
