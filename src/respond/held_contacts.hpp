// In place of 3.7-3.11 (METHODS §9.2): tissue vertices in faces and tissue edges across edges (of other tissue, too)
// are held by stiff contacts in every sub-step, which clear the depth within the settle time, never pull, and give the
// tool exactly the momentum that the tissue gets. What rests stays known for a small gap: else it would be lost and
// found again every other tick.
#pragma once

#include <optional>
#include <vector>

#include "respond/contact_reduction.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

/// A tissue vertex that a face held in the last tick.
struct RestingVertex {
    Index vertex = -1;
    Index triangle = -1;
    Index face_body = -1;
    Vector3 normal = Vector3::Zero();
};

/// Sine of the bend below which an edge counts as level.
constexpr double level_sine = 0.02;

/// True when all faces at the edge p-q fall away below the plane through the edge with this unit normal, at the sine
/// `least` or steeper; a level edge counts, unless told otherwise.
[[nodiscard]] bool faces_below(const ThesisState& state, const Matrix3X& position, Index p, Index q,
                               const Vector3& normal, double least = -level_sine);

/// A vertex beside or inside a body, seen from where the body's surface is nearest to it; the search starts at this
/// triangle. With the blended normal; the depth is negative outside.
[[nodiscard]] VertexInFace vertex_at_surface(const ThesisState& state, const Frame& frame, Index vertex,
                                             Index face_body, Index triangle);

class HeldContacts {
public:
    void prepare();
    /// A tissue vertex below a face of an instrument or bone.
    void hold_nearest(const ThesisState& state, const Frame& frame, VertexInFace v, Effect& effect);
    /// Pushes tissue at `b` from `a`, points of two triangles whose edges cross, along the shortest way by which they
    /// get clear of each other. `key` names the edges where they are known.
    void hold_crossing(const ThesisState& state, const Frame& frame, const Contact& contact, const LoadPoint& a,
                       const LoadPoint& b, const EdgeKey* key, Effect& effect);
    /// The same for edges that are known, and only where they are what separates the two bodies, that is where a plane
    /// through both has the faces of one on one side and those of the other on the other. The direction is outwards
    /// from a closed body, else to where `side` says that it belongs (on which side of the tissue, +1: front), else
    /// the pair's own. False where they are not.
    bool hold_edges_apart(const ThesisState& state, const Frame& frame, Index body_a, std::optional<double> side,
                          const EdgePair& pair, Effect& effect);
    /// Pushes tissue at `b` along `direction` (unit) from the point `a` of body_a, beyond which it is by `gap` (m). A
    /// body_a that is tissue takes the reaction at its vertices.
    static void hold_points_apart(const ThesisState& state, const Frame& frame, Index body_a, const LoadPoint& a,
                                  const LoadPoint& b, const Vector3& direction, double gap, Effect& effect);
    /// True when a corner of this triangle is held by a face of this body in the tick at hand.
    [[nodiscard]] bool holds_corner(const Topology& topology, Index triangle, Index body) const;
    /// After all contacts of the tick: those of the last tick that have come apart a little.
    void keep_resting(const ThesisState& state, const Frame& frame, Effect& effect);
    /// A vertex that the face is about to meet: its depth may be negative. `rests`: it is on the face already. After
    /// keep_resting.
    void hold_ahead(const ThesisState& state, const Frame& frame, const VertexInFace& v, bool rests, Effect& effect);
    [[nodiscard]] const std::vector<RestingVertex>& resting() const { return resting_; }

private:
    struct HeldEdges {
        EdgeKey vertex{};
        Index body_a = -1;
        Vector3 normal = Vector3::Zero();  ///< unit, pushes b from a
    };
    void hold_edges(const ThesisState& state, const Frame& frame, Index body_a, const LoadPoint& a, const LoadPoint& b,
                    const Vector3& direction, double gap, const EdgeKey* key, Effect& effect);
    void hold_vertex(const ThesisState& state, const Frame& frame, const VertexInFace& v, Effect& effect);
    static void push_vertex(const ThesisState& state, const Frame& frame, const VertexInFace& v, Effect& effect);
    void keep_vertices(const ThesisState& state, const Frame& frame, Effect& effect);
    void keep_edges(const ThesisState& state, const Frame& frame, Effect& effect);

    std::vector<RestingVertex> resting_;
    std::vector<RestingVertex> resting_now_;
    std::vector<HeldEdges> edges_;
    std::vector<HeldEdges> edges_now_;
};

}  // namespace trocar
