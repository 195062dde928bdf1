#include "detect/clustered_answer.hpp"

#include <algorithm>
#include <cstdint>

#include "detect/narrow_phase.hpp"
#include "detect/pair_sort.hpp"
#include "detect/swept.hpp"

namespace trocar {

void ClusteredAnswer::build() {
    sorting_.reserve(ordinary_contact);
    last_pairs_.reserve(ordinary_contact);
}

void ClusteredAnswer::test_last_pairs(const Frame& frame, ContactSet& contacts) {
    for (const TrianglePair& pair : last_pairs_) {
        if (!test_one(frame, pair, contacts)) return;
    }
}

void ClusteredAnswer::test_candidates(const Frame& frame, const std::vector<TrianglePair>& candidates,
                                      ContactSet& contacts) {
    if (!settings_.limited()) {
        const auto count = static_cast<std::int64_t>(candidates.size());
        work_.counters.triangle_tests += clock_.way ? 2 * count : count;
        test_pairs(settings_.test, bodies_.topology(), frame, candidates, contacts.pairs, filter_);
        if (clock_.way) test_swept(bodies_.topology(), frame, candidates, contacts.swept);
        return;
    }
    for (const TrianglePair& pair : candidates) {
        if (std::binary_search(last_pairs_.begin(), last_pairs_.end(), pair)) continue;
        if (!test_one(frame, pair, contacts)) return;
    }
}

bool ClusteredAnswer::test_one(const Frame& frame, const TrianglePair& pair, ContactSet& contacts) {
    if (full(contacts.pairs.size()) || !work_.spend(work_.counters.triangle_tests, 1)) return false;
    test_pairs(settings_.test, bodies_.topology(), frame, {&pair, 1}, contacts.pairs, filter_);
    if (!clock_.way || !either_moved(bodies_.topology(), frame, pair)) return true;
    if (full(contacts.swept.size()) || !work_.spend(work_.counters.triangle_tests, 1)) return false;
    test_swept(bodies_.topology(), frame, {&pair, 1}, contacts.swept);
    return true;
}

/// One more would be more than max_pairs: the tick ends.
bool ClusteredAnswer::full(std::size_t count) {
    if (static_cast<std::int64_t>(count) < settings_.max_pairs) return false;
    work_.truncated = true;
    return true;
}

void ClusteredAnswer::keep_unmoved_pairs(ContactSet& contacts) const {
    if (clock_.answered_at == ClusteredClock::never || !bodies_.two_rest_in_part()) return;
    for (const TrianglePair& pair : last_pairs_) {
        if (!bodies_.in_moved_group(pair.a) && !bodies_.in_moved_group(pair.b)) contacts.pairs.push_back(pair);
    }
}

void ClusteredAnswer::close(ContactSet& contacts) {
    sort_pairs(contacts.pairs, sorting_);
    sort_swept(contacts.swept);
    last_pairs_ = contacts.pairs;
}

}  // namespace trocar
