// Compares one tick with truth, outside every timed span. Pairs and contacts are judged on the frame that detect read,
// residual penetration on the frame after the step.
#pragma once

#include <span>
#include <vector>

#include "contact/contact_set.hpp"
#include "measure/depth_truth.hpp"
#include "measure/overlap.hpp"
#include "measure/step_row.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Copies the figures of a frame into its row.
void add_depth(const DepthTruth::Result& left, StepRow& row);

class Judge {
public:
    /// `yielding`: one flag per body pair that counts for residual penetration. `materials`: of the tissue, for its
    /// strain; null or without springs: none. Topology and materials outlive the judge.
    Judge(const Topology& topology, const Frame& first, std::span<const std::uint8_t> yielding,
          const Materials* materials = nullptr);

    /// Fills the pair errors of the row; in detail also those of proximity pairs and the depth errors of contacts.
    void judge_detection(const Frame& seen, const ContactSet& contacts, StepRow& row, bool in_detail = true);
    /// Fills depth, wrong sides, overshoot and strain over the limit; in detail also the overlap. Depths stay unset
    /// when no body pair yields. `scripted_path`: m, path of scripted motion since the start; a gap that the script
    /// opened is no overshoot.
    void judge_outcome(const Frame& after, StepRow& row, double scripted_path = 0.0, bool in_detail = true);

    /// Follows a frame that is not judged, so that sides are counted from the first frame on.
    void follow(const Frame& frame) { depth_.follow(frame); }

    /// m, residual penetration of a frame that is not judged.
    [[nodiscard]] double depth(const Frame& frame) { return depth_.measure(frame).residual_penetration; }

    /// DepthTruth::clearance of two bodies on the frame judged last.
    [[nodiscard]] double clearance(Index body_a, Index body_b) const { return depth_.clearance(body_a, body_b); }

    /// Ticks after the last depth in which a gap counts as overshoot.
    static constexpr std::int64_t overshoot_window = 20;

    /// Largest |depth - true depth| of contacts on the frame judged last, m; NaN when none has a depth.
    [[nodiscard]] double worst_error(std::span<const Contact> contacts) const;

private:
    [[nodiscard]] double true_depth(const Contact& contact) const;
    void judge_overlap(const Frame& after, StepRow& row);

    const Topology* topology_;
    const Materials* materials_;
    std::vector<std::uint8_t> yielding_;
    bool anything_yields_ = false;
    DepthTruth depth_;
    OverlapTruth overlap_;
    std::int64_t last_depth_tick_ = -1;  ///< -1: none yet
    double last_depth_path_ = 0.0;
};

}  // namespace trocar
