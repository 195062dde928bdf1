// Active-set search for the contacts of a step: which act, and which of them are at their force limit. The caller
// solves each guess exactly.
#pragma once

#include <span>

#include "tissue/tick_contacts.hpp"

namespace trocar {

/// True if an active contact with this `force` (N) of its law exceeds its limit in a direction in which it can act.
inline bool reaches_limit(const TickContact& contact, double force) {
    return contact.on && !contact.capped && (force > contact.limit || (contact.pulls && force < -contact.limit));
}

inline bool leaves_limit(const TickContact& contact, double force) {
    return contact.force >= 0.0 ? force < contact.limit : force > -contact.limit;
}

/// Active-set method for backward Euler of all contacts over a step of h (s). An active contact exerts the force of its
/// StepLaw at the rate (m/s) after the step. Only contacts that pull have a negative force. `solved()` solves for the
/// current flags `on` and `capped` and returns false if it cannot. `rate_of(contact)` then returns the contact's rate
/// (m/s). Sets `force` (N). Returns false if a guess cannot be solved or the search does not settle.
template <typename Solved, typename RateOf>
bool find_active(std::span<TickContact> contacts, double h, const Solved& solved, const RateOf& rate_of) {
    constexpr int most_changes = 60;
    // Simultaneous changes settle most steps in a few rounds. They may cycle where many contacts share few vertices.
    // One change at a time, always the first, cannot cycle (Murty 1974, least index).
    constexpr int rounds_at_once = 8;
    for (int change = 0; change < most_changes; ++change) {
        if (!solved()) return false;
        bool settled = true;
        for (TickContact& contact : contacts) {
            const double rate = rate_of(contact);
            const double force = contact.law(h).force(rate) + contact.held;
            if (contact.capped && !leaves_limit(contact, force)) continue;
            if (contact.capped || reaches_limit(contact, force)) {
                if (change < rounds_at_once || settled) {
                    contact.capped = !contact.capped;
                    contact.force = contact.within_limit(force);
                }
                settled = false;
                continue;
            }
            contact.force = contact.on ? force : 0.0;
            if (contact.pulls) continue;
            const bool leaves = contact.on && force < 0.0;
            const bool joins = !contact.on && force > 0.0;
            if (leaves) contact.force = 0.0;
            if (!leaves && !joins) continue;
            if (change < rounds_at_once || settled) contact.on = joins;
            settled = false;
        }
        if (settled) return true;
    }
    return false;
}

}  // namespace trocar
