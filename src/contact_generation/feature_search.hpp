// From pairs of triangles to pairs of features: which vertices and faces, which edges come closest to each other where
// two surfaces are near. Shared by the sources `proximity` and `tracked_proximity`; what is near is the detector's
// answer alone.
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
    Vector3 weights = Vector3::Zero();  ///< of the nearest point of the face
    Vector3 path = Vector3::Zero();     ///< m, from there to the vertex
    double distance = 0.0;              ///< m
    /// The nearest point is one of the whole surface around it (no way along the surface leads closer), and this is the
    /// lowest triangle that it belongs to.
    bool is_closest = false;
    Vector3 front = Vector3::Zero();  ///< unit, outer normal of the surface there; set where is_closest
};

/// Two edges of two bodies that come closest between their ends, as ridges that face each other.
struct EdgeEdge {
    Index edge_a = -1;
    Index edge_b = -1;
    Index body_a = -1;
    Index body_b = -1;
    double fraction_a = 0.0;  ///< of the way from the first to the second end
    double fraction_b = 0.0;
    Vector3 normal = Vector3::Zero();  ///< unit, from a to b
    double distance = 0.0;             ///< m
    bool may_be_apart = false;         ///< no face at either edge rises into the gap between them
    bool may_have_crossed = false;     ///< the same where each of them has passed the other
};

/// Names two features, whatever triangles they were found by.
std::uint64_t point_face_id(Index vertex, Index triangle);
std::uint64_t edge_edge_id(Index edge_a, Index edge_b);

class FeatureSearch {
public:
    void prepare(const Topology& topology);
    /// All features of the pairs, meeting or near, each once. Faces and vertices further apart than the reach are left
    /// out.
    void run(const TickStart& start, const ContactSet& contacts);
    [[nodiscard]] const std::vector<PointFace>& point_faces() const { return point_faces_; }
    [[nodiscard]] const std::vector<EdgeEdge>& edge_edges() const { return edge_edges_; }
    [[nodiscard]] const FeatureMesh& mesh() const { return mesh_; }
    /// Nearest point of a triangle's surface to a point, by a walk from triangle to triangle that starts at this one;
    /// nothing but triangle, weights, way, distance, is_closest and front is set.
    [[nodiscard]] PointFace walk(const TickStart& start, const Vector3& point, Index face_body, Index triangle) const;

private:
    void examine_pair(const TickStart& start, const TrianglePair& pair);
    void examine_point(const TickStart& start, Index vertex, Index vertex_body, Index triangle, Index face_body);
    void examine_edges(const TickStart& start, Index edge_a, Index body_a, Index edge_b, Index body_b);
    void place(const TickStart& start, const Vector3& point, PointFace& found) const;
    /// `fully`: sets `front` where it is not the closest, too.
    void judge(const TickStart& start, bool fully, PointFace& found) const;
    [[nodiscard]] bool is_ridge(const TickStart& start, Index edge, Index body, const Vector3& normal) const;

    FeatureMesh mesh_;
    KeySet seen_;
    double query_distance_ = 0.0;
    std::vector<PointFace> point_faces_;
    std::vector<EdgeEdge> edge_edges_;
};

}  // namespace trocar
