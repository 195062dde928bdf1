// Tissue against tissue in the response `thesis` (§3.4.5): the printed exchange of velocities per triangle pair; in
// `corrected` an impulse along the contact normal.
#pragma once

#include "contact/contact.hpp"
#include "contact/response_output.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

/// Eq. 3.12-3.17 on the closest vertex pair, once per triangle pair: an even number of pairs cancels (METHODS §13, 15).
void exchange(ThesisState& state, const Frame& frame, const Contact& contact);

/// Corrected: impulse along the contact normal when closing, and a penalty of stiffness `k` (N/m) on the overlap
/// `depth` (m). `pushed` moves along `normal`, `other` against it.
void bounce(ThesisState& state, const Frame& frame, const Vector3& normal, const ContactPoint& pushed,
            const ContactPoint& other, double depth, double k, ResponseOutput& output);

}  // namespace trocar
