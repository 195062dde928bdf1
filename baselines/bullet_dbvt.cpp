// Bullet's dynamic bounding volume tree (btDbvt), one tree per body with a leaf per triangle, followed by our exact
// triangle test.
//
// Settings, and where they depart from the library's default:
// * manual bottom-up refit: leaves get their new boxes, then every inner node is merged from its children in one pass.
//   Bullet's own btDbvt::update (update=reinsert) takes each leaf out and puts it back, which is far slower when every
//   vertex moves.
// * optimizeTopDown once after the build: the best tree the library makes by itself.
// * Debian's build "bullet" stores float boxes; they are rounded outward, so that nothing is missed.
// * within a query distance every box has half of it added on all sides, in both trees; bodies at rest are followed
//   when the query distance changes.
#include <BulletCollision/BroadphaseCollision/btDbvt.h>
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

/// btDbvt copies would share nodes; each body owns one tree at a fixed address.
struct Tree {
    btDbvt tree;
    std::vector<btDbvtNode*> leaves;  ///< by triangle of the body
    std::vector<btDbvtNode*> inner;   ///< children before parents
};

btDbvtVolume volume_of(const Topology& topology, const baselines::FloatVertices& vertices, Index triangle,
                       double around) {
    const baselines::FloatBox box = vertices.box_of(topology, triangle, around);
    return btDbvtVolume::FromMM({box.low[0], box.low[1], box.low[2]}, {box.high[0], box.high[1], box.high[2]});
}

void list_inner_nodes(btDbvtNode* root, std::vector<btDbvtNode*>& inner) {
    inner.clear();
    if (root == nullptr) return;
    std::vector<btDbvtNode*> stack{root};
    while (!stack.empty()) {
        btDbvtNode* node = stack.back();
        stack.pop_back();
        if (!node->isinternal()) continue;
        inner.push_back(node);
        stack.push_back(node->childs[0]);
        stack.push_back(node->childs[1]);
    }
    std::reverse(inner.begin(), inner.end());
}

struct ExactTest final : btDbvt::ICollide {
    const Topology* topology = nullptr;
    const Frame* frame = nullptr;
    ContactSet* contacts = nullptr;
    void Process(const btDbvtNode* first, const btDbvtNode* second) override {
        baselines::test_candidate(*topology, *frame, first->dataAsInt, second->dataAsInt, *contacts);
    }
};

class BulletDbvt final : public Detector {
public:
    explicit BulletDbvt(bool reinsert) : reinsert_(reinsert) {}
    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        trees_.clear();
        reported_query_distance_ = 0.0;
        if (!is_answerable(*topology_, frame)) return;
        vertices_.narrow(frame);
        for (const BodyRange& body : topology.bodies) {
            auto tree = std::make_unique<Tree>();
            tree->leaves.reserve(static_cast<std::size_t>(body.triangles.count));
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                btDbvtNode* leaf = tree->tree.insert(volume_of(topology, vertices_, t, 0.0), nullptr);
                leaf->dataAsInt = t;
                tree->leaves.push_back(leaf);
            }
            tree->tree.optimizeTopDown();
            list_inner_nodes(tree->tree.m_root, tree->inner);
            trees_.push_back(std::move(tree));
        }
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        if (trees_.empty() && !topology_->bodies.empty()) prepare(*topology_, frame);
        vertices_.narrow(frame);
        const bool other_query_distance = query_distance_ != reported_query_distance_;
        reported_query_distance_ = query_distance_;
        for (std::size_t i = 0; i < trees_.size(); ++i) {
            const BodyRange& body = topology_->bodies[i];
            if (!other_query_distance && !baselines::may_have_moved(frame, body)) continue;
            Tree& tree = *trees_[i];
            if (reinsert_) {
                for (Index t = 0; t < body.triangles.count; ++t) {
                    btDbvtVolume volume =
                        volume_of(*topology_, vertices_, body.triangles.first + t, query_distance_ / 2.0);
                    tree.tree.update(tree.leaves[static_cast<std::size_t>(t)], volume);
                }
                continue;
            }
            for (Index t = 0; t < body.triangles.count; ++t) {
                tree.leaves[static_cast<std::size_t>(t)]->volume =
                    volume_of(*topology_, vertices_, body.triangles.first + t, query_distance_ / 2.0);
            }
            for (btDbvtNode* node : tree.inner) {
                Merge(node->childs[0]->volume, node->childs[1]->volume, node->volume);
            }
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        contacts.query_distance = query_distance_;
        ExactTest test;
        test.topology = topology_;
        test.frame = &frame;
        test.contacts = &contacts;
        for (auto [a, b] : topology_->body_pairs) {
            Tree& tree_a = *trees_[static_cast<std::size_t>(a)];
            Tree& tree_b = *trees_[static_cast<std::size_t>(b)];
            tree_a.tree.collideTTpersistentStack(tree_a.tree.m_root, tree_b.tree.m_root, test);
        }
        contacts.sort();
    }

private:
    bool reinsert_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;           ///< m
    double reported_query_distance_ = 0.0;  ///< m, that the boxes in the trees were made for
    baselines::FloatVertices vertices_;
    std::vector<std::unique_ptr<Tree>> trees_;
};

}  // namespace

DetectorEntry bullet_dbvt_detector();
DetectorEntry bullet_dbvt_detector() {
    return {
        .name = "bullet_dbvt",
        .library = "Bullet",
        .version = std::to_string(BT_BULLET_VERSION / 100) + "." + std::to_string(BT_BULLET_VERSION % 100),
        .configuration = "btDbvt, single precision; candidates decided by trocar's exact test",
        .query_distance = true,
        .parameters = {choice_parameter("update", "refit", {"refit", "reinsert"},
                                        "new boxes bottom up in the same tree, or the library's update of each leaf")},
        .make = [](const ParameterValues& parameters) {
            return std::make_unique<BulletDbvt>(parameters.is("update", "reinsert"));
        }};
}

}  // namespace trocar
