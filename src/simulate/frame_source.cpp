#include "simulate/frame_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/derive.hpp"
#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"
#include "method/frame_check.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "simulate/simulation.hpp"

namespace trocar {
namespace {

class RecordedFrames final : public FrameSource {
public:
    explicit RecordedFrames(const std::filesystem::path& file) : reader_(file) {}
    [[nodiscard]] const Topology& topology() const override { return reader_.topology(); }
    [[nodiscard]] double dt() const override { return reader_.dt(); }
    [[nodiscard]] std::int64_t frame_count() const override { return reader_.frame_count(); }
    bool next(Frame& frame) override {
        if (tick_ >= reader_.frame_count()) return false;
        reader_.read(tick_++, frame);
        return true;
    }

private:
    RecordingReader reader_;
    std::int64_t tick_ = 0;
};

class NeutralPairs final : public Detector {
public:
    void prepare(const Topology& topology, const Frame& /*frame*/) override { topology_ = &topology; }
    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        triangle_boxes(frame.position, topology_->triangles, boxes_);
    }
    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_no_query_distance(query_distance_, contacts)) return;
        for (const auto& [body_a, body_b] : topology_->body_pairs) {
            overlapping_boxes(boxes_, topology_->bodies[static_cast<std::size_t>(body_a)].triangles,
                              topology_->bodies[static_cast<std::size_t>(body_b)].triangles, candidates_);
            for (const IndexPair& candidate : candidates_) {
                if (triangles_intersect(corners_of(topology_->triangles, frame.position, candidate.first),
                                        corners_of(topology_->triangles, frame.position, candidate.second))) {
                    contacts.pairs.push_back({candidate.first, candidate.second});
                }
            }
        }
        contacts.sort();
    }

private:
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    std::vector<Box> boxes_;
    std::vector<IndexPair> candidates_;
};

/// Simplest response that keeps bodies from passing through each other: a spring per triangle pair between the two
/// vertices of the contact.
class DriverPush final : public Response {
public:
    void prepare(const Topology& topology, const Materials& /*materials*/) override { topology_ = &topology; }
    void respond(const Frame& frame, double /*dt*/, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        for (const Contact& contact : contacts.contacts) {
            if (!std::isfinite(contact.depth) || contact.vertex_a < 0 || contact.vertex_b < 0 ||
                !contact.normal.allFinite() || contact.kind == ContactCase::touch) {
                continue;
            }
            const Index body_a = topology_->body_of_triangle[static_cast<std::size_t>(contact.a)];
            const Index body_b = topology_->body_of_triangle[static_cast<std::size_t>(contact.b)];
            const bool tissue_a = topology_->bodies[static_cast<std::size_t>(body_a)].kind == BodyKind::tissue;
            const bool tissue_b = topology_->bodies[static_cast<std::size_t>(body_b)].kind == BodyKind::tissue;
            if (tissue_b || !tissue_a) push(frame, contact, contact.vertex_b, contact.vertex_a, 1.0, body_a, output);
            if (tissue_a) push(frame, contact, contact.vertex_a, contact.vertex_b, -1.0, body_b, output);
        }
    }

private:
    static constexpr double stiffness = scene_frames_stiffness;
    static constexpr double damping = 2.0;      ///< N s/m
    static constexpr double most_depth = 5e-3;  ///< m; a plane's depth can far exceed the true one

    static void push(const Frame& frame, const Contact& contact, Index pushed, Index other, double sign, Index reaction,
                     ResponseOutput& output) {
        ContactForceLaw link;
        link.vertices[0] = pushed;
        link.weights[0] = 1.0;
        link.normal = sign * contact.normal;
        link.gap = -std::min(contact.depth, most_depth) - contact.approach;
        link.k = stiffness;
        link.mu = damping;
        link.face_velocity = frame.velocity.col(other).dot(link.normal);
        link.reaction_body = reaction;
        link.reaction_point = frame.position.col(pushed);
        output.contacts.push_back(link);
    }
    const Topology* topology_ = nullptr;
};

class SceneFrames final : public FrameSource {
public:
    SceneFrames(const Scene& scene, std::int64_t ticks)
        : scene_(scene),
          ticks_(ticks),
          // Not watched: this response is no result, and repeated scenes load it abruptly.
          drive_(scene, neutral_pairs(), std::make_unique<DriverPush>(), registry().contact_generator("intersection"),
                 {.watched = false}) {}
    [[nodiscard]] const Topology& topology() const override { return scene_.topology; }
    [[nodiscard]] double dt() const override { return scene_.dt; }
    [[nodiscard]] std::int64_t frame_count() const override { return ticks_; }
    bool next(Frame& frame) override {
        if (tick_ >= ticks_ || !drive_.outcome().ok()) return false;
        drive_.step();
        if (!drive_.outcome().ok()) return false;
        ++tick_;
        frame = drive_.seen();
        return true;
    }
    [[nodiscard]] Outcome outcome() const override {
        Outcome outcome = drive_.outcome();
        if (!outcome.ok()) outcome.message = fmt::format("no frame after {} of {}: {}", tick_, ticks_, outcome.message);
        return outcome;
    }

private:
    const Scene& scene_;
    std::int64_t ticks_;
    std::int64_t tick_ = 0;
    Simulation drive_;
};

}  // namespace

std::unique_ptr<FrameSource> recorded_frames(const std::filesystem::path& file) {
    return std::make_unique<RecordedFrames>(file);
}

std::unique_ptr<Detector> neutral_pairs() { return std::make_unique<NeutralPairs>(); }

std::unique_ptr<FrameSource> scene_frames(const Scene& scene, std::int64_t ticks) {
    return std::make_unique<SceneFrames>(scene, ticks);
}

}  // namespace trocar
