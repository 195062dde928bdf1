// Bullet's GImpact: one quantised box tree per body, refitted each tick, tree against tree for the candidates, followed
// by our exact triangle test.
//
// Settings, and where they depart from the library's default:
// * the tree class btGImpactQuantizedBvh is driven through its own primitive interface instead of a collision shape:
//   shape, margin (default 0.01 units) and contact generation would only add work and false candidates.
// * update() each tick: the library's own refit of a deforming mesh. update=rebuild builds the tree anew.
// * boxes are quantised to 16 bits over the bounds of the build plus one unit, rounded to nearest. Two quanta are added
//   to each box, so that rounding cannot lose a pair (default: none, touching pairs get lost).
// * a vertex outside the bounds of the build would be clamped and missed: the tree is rebuilt in a tick in which a body
//   leaves them (default: silently wrong).
#include <BulletCollision/Gimpact/btGImpactQuantizedBvh.h>
#include <LinearMath/btScalar.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "candidates.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

static_assert(sizeof(btScalar) == sizeof(float), "this adapter is written for the single-precision package");

/// One body's boxes as GImpact asks for them.
class BodyBoxes final : public btPrimitiveManagerBase {
public:
    BodyBoxes(const Topology& topology, const BodyRange& body) : topology_(&topology), body_(body) {}
    void examine(const Frame& frame, double inflation) {
        frame_ = &frame;
        inflation_ = inflation;
    }
    [[nodiscard]] bool is_trimesh() const override { return false; }
    [[nodiscard]] int get_primitive_count() const override { return body_.triangles.count; }
    void get_primitive_box(int prim_index, btAABB& primbox) const override {
        const Box box = box_of(corners_of(topology_->triangles, frame_->position, body_.triangles.first + prim_index));
        for (int axis = 0; axis < 3; ++axis) {
            primbox.m_min[axis] = baselines::round_down(box.min[axis] - inflation_);
            primbox.m_max[axis] = baselines::round_up(box.max[axis] + inflation_);
        }
    }
    void get_primitive_triangle(int /*prim_index*/, btPrimitiveTriangle& /*triangle*/) const override {}
    [[nodiscard]] const BodyRange& body() const { return body_; }

private:
    const Topology* topology_;
    BodyRange body_;
    const Frame* frame_ = nullptr;
    double inflation_ = 0.0;
};

/// Address is stable: the tree holds a pointer to the boxes.
struct BodyTree {
    BodyTree(const Topology& topology, const BodyRange& body) : boxes(topology, body), tree(&boxes) {}
    BodyBoxes boxes;
    btGImpactQuantizedBvh tree;
    Box bounds;              ///< what the quantisation covers
    double inflation = 0.0;  ///< m, two quanta
};

/// The library adds one unit around the box of the build.
constexpr double library_bound_margin = 1.0;

void build(const Frame& frame, BodyTree& body) {
    const Box box = baselines::box_of_body(frame, body.boxes.body());
    const double extent = (box.max - box.min).maxCoeff() + 2.0 * library_bound_margin;
    body.inflation = 2.0 * extent / 65535.0;
    body.bounds.min = box.min.array() - 0.5 * library_bound_margin;
    body.bounds.max = box.max.array() + 0.5 * library_bound_margin;
    body.boxes.examine(frame, body.inflation);
    body.tree.buildSet();
}

class BulletGimpact final : public Detector {
public:
    explicit BulletGimpact(bool rebuild) : rebuild_(rebuild) {}
    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        bodies_.clear();
        if (!is_answerable(*topology_, frame)) return;
        for (const BodyRange& body : topology.bodies) {
            bodies_.push_back(std::make_unique<BodyTree>(topology, body));
            if (body.triangles.count > 0) build(frame, *bodies_.back());
        }
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        if (bodies_.empty() && !topology_->bodies.empty()) prepare(*topology_, frame);
        for (const auto& body : bodies_) {
            if (body->boxes.body().triangles.count == 0) continue;
            if (!baselines::may_have_moved(frame, body->boxes.body())) {
                body->boxes.examine(frame, body->inflation);
                continue;
            }
            const Box box = baselines::box_of_body(frame, body->boxes.body());
            const bool inside = (box.min.array() >= body->bounds.min.array()).all() &&
                                (box.max.array() <= body->bounds.max.array()).all();
            if (inside && !rebuild_) {
                body->boxes.examine(frame, body->inflation);
                body->tree.update();
            } else {
                build(frame, *body);
            }
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        if (!check_no_query_distance(query_distance_, contacts)) return;
        for (auto [a, b] : topology_->body_pairs) {
            const BodyTree& body_a = *bodies_[static_cast<std::size_t>(a)];
            const BodyTree& body_b = *bodies_[static_cast<std::size_t>(b)];
            const Range range_a = body_a.boxes.body().triangles;
            const Range range_b = body_b.boxes.body().triangles;
            if (range_a.count == 0 || range_b.count == 0) continue;
            candidates_.resize(0);
            btGImpactQuantizedBvh::find_collision(&body_a.tree, btTransform::getIdentity(), &body_b.tree,
                                                  btTransform::getIdentity(), candidates_);
            for (int i = 0; i < candidates_.size(); ++i) {
                baselines::test_candidate(*topology_, frame, range_a.first + candidates_[i].m_index1,
                                          range_b.first + candidates_[i].m_index2, contacts);
            }
        }
        contacts.sort();
    }

private:
    bool rebuild_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    std::vector<std::unique_ptr<BodyTree>> bodies_;
    btPairSet candidates_;
};

}  // namespace

DetectorEntry bullet_gimpact_detector();
DetectorEntry bullet_gimpact_detector() {
    return {.name = "bullet_gimpact",
            .library = "Bullet",
            .version = std::to_string(BT_BULLET_VERSION / 100) + "." + std::to_string(BT_BULLET_VERSION % 100),
            .configuration = "GImpact quantised tree, single precision; candidates decided by trocar's exact test",
            .parameters = {choice_parameter("update", "refit", {"refit", "rebuild"},
                                            "follow the vertices in the same tree, or build a new tree every tick")},
            .make = [](const ParameterValues& parameters) {
                return std::make_unique<BulletGimpact>(parameters.is("update", "rebuild"));
            }};
}

}  // namespace trocar
