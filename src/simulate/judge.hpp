// Holds one tick against truth, outside every timed span: pairs and contacts on the frame that detect saw, what is left
// over on the frame after the step.
#pragma once

#include <span>
#include <vector>

#include "contact/contact_set.hpp"
#include "measure/depth_truth.hpp"
#include "measure/step_row.hpp"
#include "scene/world.hpp"

namespace trocar {

class Judge {
public:
    /// `yielding`: one flag per body pair, those that count for the depth left over. The topology outlives the judge.
    Judge(const Topology& topology, const Frame& first, std::span<const std::uint8_t> yielding);

    /// Fills the pair errors and the depth errors of the row.
    void judge_detection(const Frame& seen, const ContactSet& contacts, StepRow& row);
    /// Fills the depth left over; leaves it unset when no body pair yields.
    void judge_outcome(const Frame& after, StepRow& row);

    /// Worst |depth - true depth| of contacts on the frame judged last, m; NaN when none claims a depth.
    [[nodiscard]] double worst_error(std::span<const Contact> contacts) const;

private:
    [[nodiscard]] double true_depth(const Contact& contact) const;

    const Topology* topology_;
    bool anything_yields_ = false;
    DepthTruth depth_;
    std::vector<TrianglePair> truth_;
    std::vector<Index> touches_;
};

}  // namespace trocar
