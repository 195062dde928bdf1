// Converts triangle pairs to feature pairs, vertex–face and edge–edge, for `proximity` and `tracked_proximity`.
// Examines the detector's pairs only.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact_generation/feature_mesh.hpp"
#include "contact_generation/key_set.hpp"
#include "contact_generation/tick_start.hpp"

namespace trocar {

/// A vertex and a face of another body, at the start of the tick.
struct PointFace {
    Index vertex = -1;
    Index triangle = -1;
    Index vertex_body = -1;
    Index face_body = -1;
    Vector3 weights = Vector3::Zero();  ///< barycentric, of the nearest point of the face
    Vector3 path = Vector3::Zero();     ///< m, from the nearest point to the vertex
    double distance = 0.0;              ///< m
    /// The nearest point is a local minimum over the surrounding surface, and this is the lowest triangle that contains
    /// it.
    bool is_closest = false;
    Vector3 front = Vector3::Zero();  ///< unit, outer normal of the surface there; set where is_closest
};

/// Two edges of two bodies, closest in their interiors, as ridges that face each other.
struct EdgeEdge {
    Index edge_a = -1;
    Index edge_b = -1;
    Index body_a = -1;
    Index body_b = -1;
    double fraction_a = 0.0;  ///< of the closest point, from the first to the second end
    double fraction_b = 0.0;
    Vector3 normal = Vector3::Zero();  ///< unit, from a to b
    double distance = 0.0;             ///< m
    bool may_be_apart = false;         ///< no face at either edge rises into the gap
    bool may_have_crossed = false;     ///< the same test if the edges have passed each other
};

/// Identifies two features, independent of the triangles in which they were found.
std::uint64_t point_face_id(Index vertex, Index triangle);
std::uint64_t edge_edge_id(Index edge_a, Index edge_b);

class FeatureSearch {
public:
    void prepare(const Topology& topology);
    /// Finds all features of `pairs` and `near`, each once, within the query distance.
    void run(const TickStart& start, const ContactSet& contacts);
    [[nodiscard]] const std::vector<PointFace>& point_faces() const { return point_faces_; }
    [[nodiscard]] const std::vector<EdgeEdge>& edge_edges() const { return edge_edges_; }
    [[nodiscard]] const FeatureMesh& mesh() const { return mesh_; }
    /// Nearest point of a surface to `point`, by a local search from triangle to triangle that starts at `triangle`.
    /// Sets triangle, face_body, weights, path, distance, is_closest and front only.
    [[nodiscard]] PointFace walk(const TickStart& start, const Vector3& point, Index face_body, Index triangle) const;

private:
    void examine_pair(const TickStart& start, const TrianglePair& pair);
    void examine_point(const TickStart& start, Index vertex, Index vertex_body, Index triangle, Index face_body);
    void examine_edges(const TickStart& start, Index edge_a, Index body_a, Index edge_b, Index body_b);
    void place(const TickStart& start, const Vector3& point, PointFace& found) const;
    /// `fully`: sets `front` even if the point is not the closest.
    void judge(const TickStart& start, bool fully, PointFace& found) const;
    [[nodiscard]] bool is_ridge(const TickStart& start, Index edge, Index body, const Vector3& normal) const;

    FeatureMesh mesh_;
    KeySet seen_;
    double query_distance_ = 0.0;
    std::vector<PointFace> point_faces_;
    std::vector<EdgeEdge> edge_edges_;
};

}  // namespace trocar
