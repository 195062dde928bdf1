// Contact generator `proximity`: features within the query distance, without history. The surface normal at the nearest
// point gives the sign of the gap. An open sheet is thus the boundary of everything behind it.
#include <algorithm>
#include <memory>
#include <vector>

#include "contact_generation/feature_contacts.hpp"
#include "contact_generation/feature_search.hpp"
#include "method/entry.hpp"

namespace trocar {
namespace {

class Near final : public ContactGenerator {
public:
    void prepare(const Topology& topology, const Frame& /*first*/) override {
        topology_ = &topology;
        search_.prepare(topology);
    }

    void gather(const Frame& frame, ContactSet& contacts) override {
        const TickStart start(*topology_, frame);
        search_.run(start, contacts);
        contacts.contacts.clear();
        add_points(start, contacts);
        for (const EdgeEdge& one : search_.edge_edges()) {
            if (!one.may_be_apart) continue;  // edges on opposite sides of a thin body appear crossed
            contacts.contacts.push_back(edge_edge_contact(start, search_.mesh(), one, false));
        }
        std::sort(contacts.contacts.begin(), contacts.contacts.end(),
                  [](const Contact& a, const Contact& b) { return a.id < b.id; });
    }

private:
    /// The nearest point determines the side of a vertex relative to a body. In front, every local minimum that faces
    /// the vertex gives a contact; behind, only the nearest point.
    void add_points(const TickStart& start, ContactSet& contacts) {
        closest_.clear();
        for (const PointFace& one : search_.point_faces()) {
            if (one.is_closest) closest_.push_back(&one);
        }
        std::sort(closest_.begin(), closest_.end(), [](const PointFace* a, const PointFace* b) {
            if (a->vertex != b->vertex) return a->vertex < b->vertex;
            if (a->face_body != b->face_body) return a->face_body < b->face_body;
            return a->distance != b->distance ? a->distance < b->distance : a->triangle < b->triangle;
        });
        const PointFace* nearest = nullptr;
        for (const PointFace* one : closest_) {
            const bool first =
                nearest == nullptr || nearest->vertex != one->vertex || nearest->face_body != one->face_body;
            if (first) nearest = one;
            const bool inside = height(*nearest) < 0.0 && nearest->distance > no_path;
            if (inside ? !first : height(*one) < 0.0 && one->distance > no_path) continue;
            Vector3 normal = home_side(topology_->bodies[at(one->face_body)]) * one->front;
            if (one->distance > no_path) normal = (inside ? -1.0 : 1.0) / one->distance * one->path;
            if (normal.isZero(0.0)) continue;  // direction undefined: surface without area
            contacts.contacts.push_back(
                point_face_contact(start, *one, normal, inside ? -one->distance : one->distance));
        }
    }
    [[nodiscard]] double height(const PointFace& one) const {
        return home_side(topology_->bodies[at(one.face_body)]) * one.path.dot(one.front);
    }

    const Topology* topology_ = nullptr;
    FeatureSearch search_;
    std::vector<const PointFace*> closest_;
};

}  // namespace

ContactGeneratorEntry proximity_contact_generator() {
    ContactGeneratorEntry entry;
    entry.name = "proximity";
    entry.version = "1";
    entry.meaning = "features within the query distance, signed by how the surface faces at the nearest point";
    entry.wants_query_distance = true;
    entry.make = [](const ParameterValues&) { return std::make_unique<Near>(); };
    return entry;
}

}  // namespace trocar
