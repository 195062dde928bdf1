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
    last_near_.reserve(ordinary_contact);
}

void ClusteredAnswer::test_last_pairs(const Frame& frame, ContactSet& contacts) {
    for (const std::vector<TrianglePair>* const last : {&last_pairs_, &last_near_}) {
        for (const TrianglePair& pair : *last) {
            if (!test_one(frame, pair, contacts)) return;
        }
    }
}

void ClusteredAnswer::test_candidates(const Frame& frame, const std::vector<TrianglePair>& candidates,
                                      ContactSet& contacts) {
    if (!settings_.limited()) {
        const auto count = static_cast<std::int64_t>(candidates.size());
        work_.counters.triangle_tests += clock_.path ? 2 * count : count;
        work_.counters.triangle_tests += test_pairs_within(clock_.query_distance, settings_.test, bodies_.topology(),
                                                           frame, candidates, contacts.pairs, contacts.near, filter_);
        if (clock_.path) test_swept(bodies_.topology(), frame, candidates, contacts.swept);
        return;
    }
    for (const TrianglePair& pair : candidates) {
        if (was_tested(pair)) continue;
        if (!test_one(frame, pair, contacts)) return;
    }
}

/// True for pairs of the last tick, which test_last_pairs tested.
bool ClusteredAnswer::was_tested(const TrianglePair& pair) const {
    return std::binary_search(last_pairs_.begin(), last_pairs_.end(), pair) ||
           std::binary_search(last_near_.begin(), last_near_.end(), pair);
}

bool ClusteredAnswer::test_one(const Frame& frame, const TrianglePair& pair, ContactSet& contacts) {
    const std::size_t meeting = contacts.pairs.size();
    if (!work_.spend(work_.counters.triangle_tests, 1)) return false;
    test_pairs(settings_.test, bodies_.topology(), frame, {&pair, 1}, contacts.pairs, filter_);
    if (clock_.query_distance > 0.0 && contacts.pairs.size() == meeting) {
        if (!work_.spend(work_.counters.triangle_tests, 1)) return false;
        if (is_near(bodies_.topology(), frame, pair, clock_.query_distance)) contacts.near.push_back(pair);
    }
    if (!clock_.path || !either_moved(bodies_.topology(), frame, pair)) return true;
    if (!work_.spend(work_.counters.triangle_tests, 1)) return false;
    test_swept(bodies_.topology(), frame, {&pair, 1}, contacts.swept);
    return true;
}

void ClusteredAnswer::keep_unmoved_pairs(ContactSet& contacts) const {
    if (clock_.answered_at == ClusteredClock::never || !bodies_.two_rest_in_part()) return;
    const auto keep = [this](const std::vector<TrianglePair>& last, std::vector<TrianglePair>& pairs) {
        for (const TrianglePair& pair : last) {
            if (!bodies_.in_moved_group(pair.a) && !bodies_.in_moved_group(pair.b)) pairs.push_back(pair);
        }
    };
    keep(last_pairs_, contacts.pairs);
    keep(last_near_, contacts.near);
}

void ClusteredAnswer::close(ContactSet& contacts) {
    sort_pairs(contacts.pairs, sorting_);
    sort_pairs(contacts.near, sorting_);
    sort_swept(contacts.swept);
    last_pairs_ = contacts.pairs;
    last_near_ = contacts.near;
}

}  // namespace trocar
