// Base of the FCL adapters: trees of the bodies, and the detector's life cycle. When FCL throws, the tick ends as
// `threw` and the trees are rebuilt at the next tick.
#pragma once

#include <fcl/geometry/bvh/BVH_model.h>
#include <fmt/format.h>

#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "method/detector.hpp"
#include "method/frame_check.hpp"

namespace trocar::baselines {

/// Throws on an FCL error code.
inline void check(int code) {
    if (code != fcl::BVH_OK) throw std::runtime_error(fmt::format("BVH error code {}", code));
}

/// BVH of one body, its vertices multiplied by `scale`; null without triangles. Throws on an FCL error.
template <typename Volume>
std::unique_ptr<fcl::BVHModel<Volume>> build_model(const Topology& topology, const Frame& frame, const BodyRange& body,
                                                   double scale = 1.0) {
    if (body.triangles.count == 0) return nullptr;
    std::vector<fcl::Vector3d> points;
    std::vector<fcl::Triangle> triangles;
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
        points.emplace_back(scale * frame.position.col(v));
    }
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        const auto corner = [&](int k) {
            return static_cast<std::size_t>(topology.triangles(k, t) - body.vertices.first);
        };
        triangles.emplace_back(corner(0), corner(1), corner(2));
    }
    auto model = std::make_unique<fcl::BVHModel<Volume>>();
    check(model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(points.size())));
    check(model->addSubModel(points, triangles));
    check(model->endModel());
    return model;
}

/// Detector base; derived classes implement four functions, all of which may throw.
class FclDetector : public Detector {
public:
    void prepare(const Topology& topology, const Frame& frame) final {
        topology_ = &topology;
        start_anew();
        if (is_answerable(topology, frame)) try_to(Step::build, frame);
    }

    void update(const Frame& frame, double query_distance) final {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        if (!built_) try_to(Step::build, frame);  // the first frame could not be built
        if (failure_.empty()) try_to(Step::follow, frame);
    }

    void detect(const Frame& frame, ContactSet& contacts) final {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        if (!answers_within_query_distance() && !check_no_query_distance(query_distance_, contacts)) return;
        contacts.query_distance = query_distance_;
        try {
            if (failure_.empty()) query(frame, contacts);
        } catch (const std::exception& error) {
            failure_ = fmt::format("FCL threw during the query: {}", error.what());
        }
        if (failure_.empty()) return;
        contacts.clear();
        contacts.outcome = {OutcomeKind::threw, failure_};
        start_anew();
    }

protected:
    [[nodiscard]] const Topology& topology() const { return *topology_; }
    [[nodiscard]] double query_distance() const { return query_distance_; }
    /// True when query() supports a query distance > 0.
    [[nodiscard]] virtual bool answers_within_query_distance() const { return false; }
    [[nodiscard]] const BodyRange& body(Index number) const {
        return topology_->bodies[static_cast<std::size_t>(number)];
    }
    /// Deletes the trees.
    virtual void forget() = 0;
    /// Builds the trees. Precondition: the frame passes is_answerable.
    virtual void build(const Frame& frame) = 0;
    /// Updates the trees to the frame. Precondition: the frame passes is_answerable.
    virtual void follow(const Frame& frame) = 0;
    /// Fills the empty contacts, sorted; `frame` is that of the last follow().
    virtual void query(const Frame& frame, ContactSet& contacts) = 0;

private:
    enum class Step { build, follow };

    void try_to(Step step, const Frame& frame) {
        try {
            if (step == Step::build) {
                built_ = true;
                build(frame);
            } else {
                follow(frame);
            }
        } catch (const std::exception& error) {
            failure_ = fmt::format("FCL threw {}: {}", step == Step::build ? "while building" : "during the update",
                                   error.what());
        }
    }
    void start_anew() {
        failure_.clear();
        built_ = false;
        forget();
    }

    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    std::string failure_;
    bool built_ = false;
};

}  // namespace trocar::baselines
