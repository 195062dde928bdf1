// The source `near`: features within reach, without memory. A gap is signed by how the surface faces at the nearest
// point, so that a sheet counts as the boundary of all that lies behind it.
#include <algorithm>
#include <memory>
#include <vector>

#include "method/entry.hpp"
#include "source/feature_contacts.hpp"
#include "source/feature_search.hpp"

namespace trocar {
namespace {

class Near final : public ContactSource {
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
            if (!one.may_be_apart) continue;  // without memory, edges seen through a thin body look crossed
            contacts.contacts.push_back(edge_edge_contact(start, search_.mesh(), one, false));
        }
        std::sort(contacts.contacts.begin(), contacts.contacts.end(),
                  [](const Contact& a, const Contact& b) { return a.id < b.id; });
    }

private:
    /// Of a vertex and a body the nearest point tells the side: in front of it, all that the vertex is in front of
    /// counts; behind it, the shortest way out does.
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
            const bool inside = height(*nearest) < 0.0 && nearest->distance > no_way;
            if (inside ? !first : height(*one) < 0.0 && one->distance > no_way) continue;
            Vector3 normal = home_side(topology_->bodies[at(one->face_body)]) * one->front;
            if (one->distance > no_way) normal = (inside ? -1.0 : 1.0) / one->distance * one->way;
            if (normal.isZero(0.0)) continue;  // on a surface without area: nothing says where to
            contacts.contacts.push_back(
                point_face_contact(start, *one, normal, inside ? -one->distance : one->distance));
        }
    }
    [[nodiscard]] double height(const PointFace& one) const {
        return home_side(topology_->bodies[at(one.face_body)]) * one.way.dot(one.front);
    }

    const Topology* topology_ = nullptr;
    FeatureSearch search_;
    std::vector<const PointFace*> closest_;
};

}  // namespace

SourceEntry near_source() {
    SourceEntry entry;
    entry.name = "near";
    entry.version = "1";
    entry.meaning = "features within reach, signed by how the surface faces at the nearest point";
    entry.wants_reach = true;
    entry.make = [](const ParameterValues&) { return std::make_unique<Near>(); };
    return entry;
}

}  // namespace trocar
