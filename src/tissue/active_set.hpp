// Which contacts of a step are on, and which of these are at their limit: a search over guesses that are each solved
// exactly. How they are solved is the stepper's.
#pragma once

#include <span>

#include "tissue/tick_contacts.hpp"

namespace trocar {

/// A contact whose law says `force` and that presses or pulls more than it may.
inline bool reaches_limit(const TickContact& contact, double force) {
    const bool pulls = contact.bilateral || contact.adhesive;
    return contact.on && !contact.capped && (force > contact.limit || (pulls && force < -contact.limit));
}

inline bool leaves_limit(const TickContact& contact, double force) {
    return contact.force >= 0.0 ? force < contact.limit : force > -contact.limit;
}

/// Backward Euler of all contacts over a step of h (s): a contact that is on gives what its StepLaw says of its rate
/// (m/s) after the step, and none but a bilateral or adhesive one pulls. `solved()` solves for the flags `on` and
/// `capped` as they are and says whether it could; `rate_of(contact)` is then its rate (m/s). False where a guess
/// cannot be solved, which makes further guesses worthless, or where none settles; forces are N.
template <typename Solved, typename RateOf>
bool find_active(std::span<TickContact> contacts, double h, const Solved& solved, const RateOf& rate_of) {
    constexpr int most_changes = 60;
    // All that have to change at once settle most steps in a few rounds. Where many contacts share few vertices that
    // may go round in circles; one at a time, always the first, cannot (Murty 1974, least index).
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
            if (contact.bilateral || contact.adhesive) continue;
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
