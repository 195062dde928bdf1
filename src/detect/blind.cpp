// A control, not a method: a detector that reports nothing. A response that moves anything with it does not act on its
// contacts. With a hidden part of the instruments' triangles it reports all other pairs exactly, which shows the effect
// of false negatives on a response. Hiding single pairs would have no effect, since several pairs share a vertex and
// face.
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {

DetectorEntry ohc_clustered_detector();

namespace {

class Blind final : public Detector {
public:
    explicit Blind(double hide) : hidden_per_million_(std::llround(hide * million)) {
        if (hidden_per_million_ == million) return;
        const DetectorEntry exact = ohc_clustered_detector();
        exact_ = exact.make(ParameterValues(exact.name, exact.parameters, {}));
    }

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        hidden_.assign(static_cast<std::size_t>(topology.triangle_count()), 0);
        for (const BodyRange& body : topology.bodies) {
            if (body.kind != BodyKind::instrument) continue;
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
                const std::int64_t number = t - body.triangles.first;
                hidden_[static_cast<std::size_t>(t)] = number * hidden_per_million_ % million < hidden_per_million_;
            }
        }
        if (exact_) exact_->prepare(topology, frame);
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (exact_) exact_->update(frame, query_distance);
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        if (exact_) {
            exact_->detect(frame, contacts);
            const auto is_hidden = [this](const TrianglePair& pair) { return hidden(pair.a) || hidden(pair.b); };
            std::erase_if(contacts.pairs, is_hidden);
            std::erase_if(contacts.near, is_hidden);
            return;
        }
        contacts.clear();
        if (check_frame(*topology_, frame, contacts)) contacts.query_distance = query_distance_;
    }

private:
    static constexpr std::int64_t million = 1000000;
    [[nodiscard]] bool hidden(Index triangle) const { return hidden_[static_cast<std::size_t>(triangle)] != 0; }

    std::int64_t hidden_per_million_;
    std::unique_ptr<Detector> exact_;  ///< null where all is hidden
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;       ///< m
    std::vector<std::uint8_t> hidden_;  ///< per triangle
};

}  // namespace

DetectorEntry blind_detector() {
    return {.name = "blind",
            .configuration = "a control, not a method: answers nothing, or all but the triangles that it hides",
            .query_distance = true,
            .control = true,
            .parameters = {number_parameter(
                "hide", "1", "1", 0.0, 1.0,
                "part of every instrument's triangles that is never in an answer, evenly spread "
                "over their numbers; 1: no answer at all, whatever the bodies")},
            .make = [](const ParameterValues& values) { return std::make_unique<Blind>(values.number("hide")); }};
}

}  // namespace trocar
