// Tissue that a face of a closed tool or bone is about to meet. Pairs of triangles tell of a vertex only once it is
// inside, and of one in the middle of a flat face not even then: what both move in a tick is how deep it would be.
// These contacts stand between them before that. They have a gap, so that the integrator lets them push only in
// sub-steps in which it would close.
#pragma once

#include <cstdint>
#include <vector>

#include "respond/held_contacts.hpp"
#include "respond/surface_blocks.hpp"
#include "respond/thesis_state.hpp"
#include "respond/triangle_grid.hpp"
#include "respond/velocity_changes.hpp"

namespace trocar {

class ApproachingFaces {
public:
    void prepare(const ThesisState& state);
    /// After all that holds vertices by what has crossed: holds every other vertex of tissue that a face may meet in
    /// this tick, and those that it has held in the last tick, which it thus knows to belong outside. Nothing unless
    /// the settings ask for it.
    void respond(const ThesisState& state, const Frame& frame, VelocityChanges& changes, HeldContacts& held,
                 Effect& effect);

private:
    /// Vertices of a tissue that may meet the faces of a closed body.
    struct Pair {
        Index body = -1;
        Index tissue = -1;
        SurfaceBlocks blocks;
        double travelled = 0.0;          ///< m, by both together since the vertices were last gone through
        double least = 0.0;              ///< m, smallest clearance then
        std::vector<double> clearance;   ///< m, per vertex: at least as far off
        std::vector<Index> triangle;     ///< per vertex: the face that held it when it was last held, -1 for none
        std::vector<std::int64_t> when;  ///< per vertex: tick in which it was last held by this body
    };
    /// The first face that a vertex would come through, else the nearest.
    struct Meeting {
        Index triangle = -1;
        Vector3 weights = Vector3::Zero();
        bool crosses = false;
        double distance = 0.0;  ///< m, of the nearest
    };
    void find_looked_at(const ThesisState& state, Pair& pair, double near);
    double look_at(const ThesisState& state, const Frame& frame, Pair& pair, Index vertex, double reach,
                   VelocityChanges& changes, HeldContacts& held, Effect& effect);
    [[nodiscard]] bool keep(const ThesisState& state, const Frame& frame, Pair& pair, Index vertex, HeldContacts& held,
                            Effect& effect);
    void meet(const ThesisState& state, const Frame& frame, Pair& pair, Index vertex, const Meeting& meeting,
              VelocityChanges& changes, HeldContacts& held, Effect& effect);

    std::vector<Pair> pairs_;
    std::int64_t tick_ = 0;
    std::vector<Index> looked_at_;
    std::vector<Index> near_;
    std::vector<Box> region_;
    TriangleGrid grid_;
};

}  // namespace trocar
