// Tissue between bodies that overlap each other has no admissible place: held hard against both, it would load the tool
// with whatever force stiff contacts reach when they contradict each other. Here both sides give way alike, as far as
// they contradict and no further, and the tissue carries the pairs' own compliant contact there instead
// (squeeze=share).
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact_set.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class SqueezedTissue {
public:
    void prepare(const Topology& topology);
    /// Looks at the stiff contacts of the effect, where bodies that no hand leads overlap each other. With d_i the
    /// depths that the contacts clear and u the motion of the tissue's vertices that minimises Σ (d_i − J_i u)₊² + ε
    /// |u|², the part J_i u of a depth can be cleared and λ_i = d_i − J_i u cannot. The contact is left to clear the
    /// former, and adds k λ_i with the softest pair's k, at most f_max.
    void share(const ThesisState& state, const ContactSet& contacts, Effect& effect);
    /// True when a corner of this triangle was squeezed in the last tick: what is left there cannot be cleared.
    [[nodiscard]] bool holds(const Topology& topology, Index triangle) const {
        const auto corner = topology.triangles.col(triangle);
        return squeezed_[static_cast<std::size_t>(corner[0])] != 0 ||
               squeezed_[static_cast<std::size_t>(corner[1])] != 0 ||
               squeezed_[static_cast<std::size_t>(corner[2])] != 0;
    }

private:
    /// A stiff contact on tissue.
    struct Row {
        std::size_t contact = 0;
        Index group = -1;    ///< body that presses; all bones are one, between tissues none
        double depth = 0.0;  ///< m, at the tick's end if the tissue stood still, and what the damper looks ahead
        double size = 0.0;   ///< |J|²
        double left = 0.0;   ///< m, λ: what the motion leaves of the depth
    };
    bool find_overlaps(const ThesisState& state, const ContactSet& contacts);
    void collect(const ThesisState& state, const Effect& effect);
    [[nodiscard]] static double along(const Effect& effect, const Row& row, const Matrix3X& motion);
    void relax(const ThesisState& state, const Effect& effect);
    [[nodiscard]] double compliant_stiffness(const ThesisState& state, const Row& row,
                                             const LinearContact& contact) const;

    std::vector<Row> rows_;
    Index bone_ = -1;                     ///< a bone that overlaps an instrument
    std::vector<std::uint8_t> overlaps_;  ///< per body
    std::vector<std::uint8_t> squeezed_;  ///< per vertex
    std::vector<Index> marked_;
    std::vector<Index> groups_;
    Matrix3X motion_;  ///< 3×N, m
};

}  // namespace trocar
