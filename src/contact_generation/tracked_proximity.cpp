// Contact generator `tracked_proximity`: features within the query distance, with sides by exact crossing counts since
// the start. A gap keeps its sign through an open sheet, at a deep start and after a jump.
#include <algorithm>
#include <cmath>
#include <memory>

#include "contact_generation/crossed_sides.hpp"
#include "contact_generation/feature_contacts.hpp"
#include "contact_generation/feature_search.hpp"
#include "contact_generation/partners.hpp"
#include "geometry/triangle_distance.hpp"
#include "method/entry.hpp"

namespace trocar {
namespace {

class TrackedProximity final : public ContactGenerator {
public:
    void prepare(const Topology& topology, const Frame& first) override {
        topology_ = &topology;
        home_.assign(at(topology.vertex_count), {});
        search_.prepare(topology);
        partners_.prepare(topology.triangle_count());
        sides_.prepare(topology, search_.mesh(), first);
    }

    void gather(const Frame& frame, ContactSet& contacts) override {
        const TickStart start(*topology_, frame);
        ++tick_;
        search_.run(start, contacts);
        partners_.gather(contacts);
        sides_.settle(start, search_.point_faces());
        contacts.contacts.clear();
        add_crossed(start, contacts);
        for (const PointFace& one : search_.point_faces()) {
            if (one.is_closest) add_over(start, one, contacts);
        }
        for (const PointFace& one : search_.point_faces()) {
            if (!one.is_closest) add_beside(start, one, contacts);
        }
        for (const EdgeEdge& one : search_.edge_edges()) {
            const bool crossed = one.may_have_crossed && have_crossed(start, one);
            if (!crossed && !one.may_be_apart) continue;
            contacts.contacts.push_back(edge_edge_contact(start, search_.mesh(), one, crossed));
        }
        std::sort(contacts.contacts.begin(), contacts.contacts.end(),
                  [](const Contact& a, const Contact& b) { return a.id < b.id; });
        sides_.carry_along(start, search_.point_faces());
    }

private:
    [[nodiscard]] bool closed(Index body) const { return topology_->bodies[at(body)].closed; }

    /// Contacts of crossed vertices at their anchors. A vertex beyond a free rim is no longer crossed.
    void add_crossed(const TickStart& start, ContactSet& contacts) {
        sides_.follow([&](CrossedLayer& layer) {
            const Vector3 x = start.position(layer.vertex, layer.vertex_body);
            PointFace one = search_.walk(start, x, layer.face_body, layer.triangle);
            one.vertex = layer.vertex;
            one.vertex_body = layer.vertex_body;
            Vector3 normal = layer.sign * one.front;
            const double depth = -one.path.dot(normal);
            constexpr double along = 0.5;  // cosine; below it the vertex is beside the surface, not behind it
            if (!closed(layer.face_body) && is_at_rim(one) && depth < along * one.distance) return false;
            if (one.distance > no_path && depth > 0.0) normal = -one.path / one.distance;
            if (!normal.isZero(0.0)) contacts.contacts.push_back(point_face_contact(start, one, normal, -one.distance));
            layer.triangle = one.triangle;
            layer.depth = one.distance;
            keep_home(one, normal, one.distance, layer.sign);
            return true;
        });
    }

    /// True if the closest point of one edge is on the wrong side of the other's body.
    [[nodiscard]] bool have_crossed(const TickStart& start, const EdgeEdge& one) const {
        if (closed(one.body_a) || !closed(one.body_b)) {
            return sides_.is_beyond(start, search_.mesh(), one.edge_b, one.fraction_b, one.body_b, one.body_a,
                                    partners_);
        }
        return sides_.is_beyond(start, search_.mesh(), one.edge_a, one.fraction_a, one.body_a, one.body_b, partners_);
    }

    [[nodiscard]] bool is_at_rim(const PointFace& one) const {
        const auto& edges = search_.mesh().edges_of(one.triangle);
        for (int i = 0; i < 3; ++i) {
            if (one.weights[i] == 0.0 && search_.mesh().is_rim(edges[at((i + 1) % 3)])) return true;
        }
        return false;
    }

    /// Contact of a vertex above a face, an edge or a corner of another body.
    void add_over(const TickStart& start, const PointFace& one, ContactSet& contacts) {
        const CrossedLayer* layer = sides_.layer(one.vertex, one.face_body);
        const double height = one.path.dot(one.front);
        // Behind a face of a closed body: either crossed (add_crossed), or beyond its far side.
        if (closed(one.face_body) && height < 0.0 && one.distance > no_path) return;
        if (layer != nullptr && layer->sign * height <= 0.0) return;
        Vector3 normal = home_side(topology_->bodies[at(one.face_body)]) * one.front;
        if (one.distance > no_path) normal = one.path / one.distance;
        if (normal.isZero(0.0)) return;  // direction undefined: surface without area
        contacts.contacts.push_back(point_face_contact(start, one, normal, one.distance));
        keep_home(one, normal, 0.0, height);
    }

    /// Contact with a face adjacent to the nearest one, so that a vertex that slides over a ridge within the tick meets
    /// the next face. On a convex ridge the gap is the distance to that face, not to its plane. A concave neighbour
    /// acts as a wall.
    void add_beside(const TickStart& start, const PointFace& one, ContactSet& contacts) const {
        const Home& home = home_[at(one.vertex)];
        if (home.tick != tick_ || home.face_body != one.face_body) return;
        constexpr double of_query_distance = 0.2;
        const double further = one.distance - home.depth;
        if (further > of_query_distance * contacts.query_distance + 2.0 * relative_motion(start, one)) return;
        Vector3 normal = area_normal(start.corners(one.triangle, one.face_body));
        const double size = normal.norm();
        if (size == 0.0) return;
        normal /= size;
        const CrossedLayer* layer = sides_.layer(one.vertex, one.face_body);
        if (layer != nullptr) normal *= layer->sign;
        if (layer == nullptr && !closed(one.face_body) && home.front < 0.0) normal = -normal;
        // Beyond a crease of more than 60° the face belongs to another side, unless the vertex rests on the edge.
        constexpr double crease = 0.5;
        constexpr double on_the_edge = 0.002;  // relative to the face's size
        if (normal.dot(home.normal) < crease && further > on_the_edge * std::sqrt(size)) return;
        PointFace under = one;
        under.weights = weights_under(start, one);
        contacts.contacts.push_back(point_face_contact(start, under, normal, one.distance - 2.0 * home.depth));
    }

    /// Between two tissues, barycentric weights of the vertex's projection on the face's plane, which makes force and
    /// reaction collinear. Weights outside the face are negative. For needle-shaped faces and other body kinds, the
    /// weights of the nearest point.
    [[nodiscard]] Vector3 weights_under(const TickStart& start, const PointFace& one) const {
        if (!start.is_tissue(one.face_body) || !start.is_tissue(one.vertex_body)) return one.weights;
        const Vector3 weights = projection_on_plane(start.corners(one.triangle, one.face_body),
                                                    start.position(one.vertex, one.vertex_body));
        constexpr double furthest = -1.0;
        return weights.allFinite() && weights.minCoeff() >= furthest ? weights : one.weights;
    }

    void keep_home(const PointFace& one, const Vector3& normal, double depth, double front) {
        Home& home = home_[at(one.vertex)];
        if (home.tick == tick_ && home.distance <= one.distance) return;
        home = {tick_, one.face_body, one.distance, depth, front, normal};
    }

    /// m, relative displacement of vertex and face point from `previous` to `position`.
    static double relative_motion(const TickStart& start, const PointFace& one) {
        const Frame& frame = start.frame();
        const auto motion = [&frame](Index v) { return Vector3(frame.position.col(v) - frame.previous.col(v)); };
        const auto corner = start.topology().triangles.col(one.triangle);
        return (motion(one.vertex) - one.weights[0] * motion(corner[0]) - one.weights[1] * motion(corner[1]) -
                one.weights[2] * motion(corner[2]))
            .norm();
    }

    /// Nearest point of another body's surface to a vertex in this tick.
    struct Home {
        std::int64_t tick = -1;
        Index face_body = -1;
        double distance = 0.0;             ///< m
        double depth = 0.0;                ///< m, 0 if it has not crossed
        double front = 0.0;                ///< > 0: belongs in front of the surface there, < 0: behind it
        Vector3 normal = Vector3::Zero();  ///< unit, towards the vertex's allowed side
    };

    const Topology* topology_ = nullptr;
    FeatureSearch search_;
    Partners partners_;
    CrossedSides sides_;
    std::vector<Home> home_;  ///< per vertex
    std::int64_t tick_ = 0;
};

}  // namespace

ContactGeneratorEntry tracked_proximity_contact_generator() {
    ContactGeneratorEntry entry;
    entry.name = "tracked_proximity";
    entry.version = "1";
    entry.meaning =
        "features within the query distance, with the side on which each belongs by the exact count of crossings";
    entry.wants_query_distance = true;
    entry.make = [](const ParameterValues&) { return std::make_unique<TrackedProximity>(); };
    return entry;
}

}  // namespace trocar
