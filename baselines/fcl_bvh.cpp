// FCL 0.7 mesh-mesh collision: one bounding volume hierarchy per body, each listed body pair traversed once a tick.
//
// Settings, and where they depart from the library's defaults (measured facts: FCL's issue numbers in README.md):
//  bv                 AABB, where FCL's users mostly take OBBRSS: a deforming mesh pays for the update, and an AABB
//                     tree is refitted some twenty times faster. All of FCL's volumes are choices of the parameter.
//  update             refit, bottom up: the library's fast path. Oriented volumes grow looser by it, so `rebuild`
//                     (a new tree every tick) and `rebuild_period` (every N ticks) are offered. RSS trees are refitted
//                     top down: after a bottom-up refit they report no contact at all (78 of 78 pairs lost). So are
//                     those of OBBRSS while a query distance is asked for, since their distance is that of their RSS.
//  beginReplaceModel  not beginUpdateModel, which keeps the frame before and bounds the swept triangles.
//  world vertices     transforms stay the identity and the vertices are the frame's: fcl::collide() would copy both
//                     models per query for AABB, RSS and KDOP trees. For the same reason the traversal node is driven
//                     directly; for OBB, OBBRSS and kIOS this is what fcl::collide() does too.
//  bodies at rest     not updated, where the frame says which vertices moved.
//  num_max_contacts   unlimited (default 1, which stops at the first hit).
//  enable_contact     only when native contacts are wanted (default off). In that mode FCL drops pairs whose contact
//                     has no points, such as triangles without area.
//  enable_cost        off, as by default: it would disable the early exit.
//  result             cleared per body pair, as it accumulates.
//  query distance     above 0 the same traversal, in which volumes part where the library's distance between them is
//                     larger; what its triangle test leaves is held against the query distance by trocar's leaf. FCL
//                     0.7 has no distance of OBB and KDOP ("not implemented"): unsupported.
// Native contacts: up to two per triangle pair; position = a vertex, depth = that vertex' distance below the other
// triangle's plane, normal = that plane's, following the winding, from the first body to the second.
#include <fcl/config.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/utility.h>
#include <fcl/narrowphase/collision_request.h>
#include <fcl/narrowphase/collision_result.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fmt/format.h>

#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "candidates.hpp"
#include "fcl_detector.hpp"
#include "method/entry.hpp"

namespace trocar {
namespace {

/// The traversal that fcl::collide() chooses for a pair of trees of this kind of volume.
template <typename Volume>
struct TraversalOf {
    using Node = fcl::detail::MeshCollisionTraversalNode<Volume>;
};
template <>
struct TraversalOf<fcl::OBBd> {
    using Node = fcl::detail::MeshCollisionTraversalNodeOBB<double>;
};
template <>
struct TraversalOf<fcl::OBBRSSd> {
    using Node = fcl::detail::MeshCollisionTraversalNodeOBBRSS<double>;
};
template <>
struct TraversalOf<fcl::kIOSd> {
    using Node = fcl::detail::MeshCollisionTraversalNodekIOS<double>;
};

/// The volumes that the library knows a distance of.
template <typename Volume>
constexpr bool has_distance = std::is_same_v<Volume, fcl::AABBd> || std::is_same_v<Volume, fcl::RSSd> ||
                              std::is_same_v<Volume, fcl::OBBRSSd> || std::is_same_v<Volume, fcl::kIOSd>;

/// The library's traversal, continued to everything within a query distance.
template <typename Volume>
struct WithinQueryDistance final : TraversalOf<Volume>::Node {
    using Base = typename TraversalOf<Volume>::Node;
    double query_distance = 0.0;
    const Topology* topology = nullptr;
    const Frame* frame = nullptr;
    Index first_triangle = 0;  ///< of either body
    Index second_triangle = 0;
    ContactSet* contacts = nullptr;

    /// True when the volumes are surely further apart; they are fitted with rounding.
    [[nodiscard]] bool BVTesting(int b1, int b2) const override {
        constexpr double surely = 1.0 + 1e-9;
        ++contacts->work.box_tests;
        return this->model1->getBV(b1).bv.distance(this->model2->getBV(b2).bv) > surely * query_distance;
    }
    void leafTesting(int b1, int b2) const override {
        const std::size_t before = this->result->numContacts();
        Base::leafTesting(b1, b2);
        ++contacts->work.triangle_tests;
        if (this->result->numContacts() != before) return;
        baselines::test_near(*topology, *frame,
                             {first_triangle + static_cast<Index>(this->model1->getBV(b1).primitiveId()),
                              second_triangle + static_cast<Index>(this->model2->getBV(b2).primitiveId())},
                             query_distance, *contacts);
    }
};

struct Settings {
    bool refit = true;
    std::int64_t rebuild_period = 0;  ///< ticks; 0: never
};

template <typename Volume>
class FclBvh final : public baselines::FclDetector {
    using Model = fcl::BVHModel<Volume>;
    using Node = typename TraversalOf<Volume>::Node;

    [[nodiscard]] bool refits_bottom_up() const {
        if (std::is_same_v<Volume, fcl::OBBRSSd>) return query_distance() == 0.0;
        return !std::is_same_v<Volume, fcl::RSSd>;
    }

public:
    explicit FclBvh(const Settings& settings) : settings_(settings) {}

private:
    void forget() override { models_.clear(); }

    void build(const Frame& frame) override {
        ticks_ = 0;
        for (const BodyRange& body : topology().bodies) {
            models_.push_back(baselines::build_model<Volume>(topology(), frame, body));
        }
    }

    void follow(const Frame& frame) override {
        ++ticks_;
        const bool rebuild =
            !settings_.refit || (settings_.rebuild_period > 0 && ticks_ % settings_.rebuild_period == 0);
        const bool other_direction = std::exchange(bottom_up_, refits_bottom_up()) != refits_bottom_up();
        for (std::size_t body = 0; body < models_.size(); ++body) {
            if (!models_[body]) continue;
            if (!rebuild && !other_direction && !baselines::may_have_moved(frame, topology().bodies[body])) continue;
            Model& model = *models_[body];
            const Range vertices = topology().bodies[body].vertices;
            baselines::check(model.beginReplaceModel());
            for (Index v = vertices.first; v < vertices.end(); ++v) model.replaceVertex(frame.position.col(v));
            baselines::check(model.endReplaceModel(!rebuild, bottom_up_));
        }
    }

    static bool start(Node& node, Model& first, Model& second, const fcl::CollisionRequestd& request,
                      fcl::CollisionResultd& result) {
        fcl::Transform3d here = fcl::Transform3d::Identity();
        fcl::Transform3d there = here;
        if constexpr (std::is_same_v<Node, fcl::detail::MeshCollisionTraversalNode<Volume>>) {
            return fcl::detail::initialize(node, first, here, second, there, request, result);
        } else {
            // Oriented volumes carry the transform along and take the models as constants.
            return fcl::detail::initialize(node, std::as_const(first), std::as_const(here), std::as_const(second),
                                           std::as_const(there), request, result);
        }
    }

    [[nodiscard]] bool answers_within_query_distance() const override { return has_distance<Volume>; }

    void query(const Frame& frame, ContactSet& contacts) override {
        fcl::CollisionRequestd request(std::numeric_limits<std::size_t>::max(), contacts.native_wanted);
        contacts.work.vertices_read = topology().vertex_count;
        for (const auto& [a, b] : topology().body_pairs) {
            Model* const first = models_[static_cast<std::size_t>(a)].get();
            Model* const second = models_[static_cast<std::size_t>(b)].get();
            if (first == nullptr || second == nullptr) continue;
            result_.clear();
            const Index first_triangle = body(a).triangles.first;
            const Index second_triangle = body(b).triangles.first;
            const auto traverse = [&](Node& node) {
                if (!start(node, *first, *second, request, result_)) {
                    throw std::runtime_error("the traversal was refused");
                }
                fcl::detail::collide(&node);
            };
            if constexpr (has_distance<Volume>) {
                if (query_distance() > 0.0) {
                    WithinQueryDistance<Volume> node;
                    node.query_distance = query_distance();
                    node.topology = &topology();
                    node.frame = &frame;
                    node.first_triangle = first_triangle;
                    node.second_triangle = second_triangle;
                    node.contacts = &contacts;
                    traverse(node);
                }
            }
            if (query_distance() == 0.0) {
                Node node;
                traverse(node);
            }
            for (std::size_t k = 0; k < result_.numContacts(); ++k) {
                const fcl::Contactd& found = result_.getContact(k);
                const TrianglePair pair{first_triangle + static_cast<Index>(found.b1),
                                        second_triangle + static_cast<Index>(found.b2)};
                contacts.pairs.push_back(pair);
                if (!contacts.native_wanted) continue;
                Contact contact;
                contact.a = pair.a;
                contact.b = pair.b;
                contact.point = found.pos;
                contact.normal = found.normal;
                contact.depth = found.penetration_depth;
                contacts.native.push_back(contact);
            }
        }
        contacts.sort();
    }

    Settings settings_;
    std::vector<std::unique_ptr<Model>> models_;  ///< one per body, null for a body without triangles
    fcl::CollisionResultd result_;
    std::int64_t ticks_ = 0;
    bool bottom_up_ = true;  ///< how the trees were refitted last
};

std::unique_ptr<Detector> make(const ParameterValues& values) {
    Settings settings;
    settings.refit = values.is("update", "refit");
    settings.rebuild_period = values.is("rebuild_period", "none") ? 0 : values.integer("rebuild_period");
    const std::string& bv = values.text("bv");
    if (bv == "OBB") return std::make_unique<FclBvh<fcl::OBBd>>(settings);
    if (bv == "RSS") return std::make_unique<FclBvh<fcl::RSSd>>(settings);
    if (bv == "OBBRSS") return std::make_unique<FclBvh<fcl::OBBRSSd>>(settings);
    if (bv == "kIOS") return std::make_unique<FclBvh<fcl::kIOSd>>(settings);
    if (bv == "KDOP16") return std::make_unique<FclBvh<fcl::KDOP<double, 16>>>(settings);
    if (bv == "KDOP18") return std::make_unique<FclBvh<fcl::KDOP<double, 18>>>(settings);
    if (bv == "KDOP24") return std::make_unique<FclBvh<fcl::KDOP<double, 24>>>(settings);
    return std::make_unique<FclBvh<fcl::AABBd>>(settings);
}

}  // namespace

DetectorEntry fcl_bvh_detector() {
    return {.name = "fcl_bvh",
            .library = "FCL",
            .version = FCL_VERSION,
            .configuration = fmt::format(
                "double precision; FCL_HAVE_SSE {}; traversal driven without copies of the models", FCL_HAVE_SSE),
            .native_contacts = true,
            .query_distance = true,
            .parameters = {choice_parameter("bv", "AABB",
                                            {"AABB", "OBB", "RSS", "OBBRSS", "kIOS", "KDOP16", "KDOP18", "KDOP24"},
                                            "bounding volume of the tree"),
                           choice_parameter(
                               "update", "refit", {"refit", "rebuild"},
                               "follow the vertices bottom up in the same tree, or build a new tree every tick"),
                           integer_parameter("rebuild_period", "none", 1, 1e9,
                                             "with update=refit: a new tree every so many ticks", {"none"})},
            .make = make};
}

}  // namespace trocar
