#include "detect/ohc_limits.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "detect/narrow_phase.hpp"
#include "detect/swept.hpp"

namespace trocar {

void OhcLimits::prepare() {
    last_pairs_.clear();
    last_near_.clear();
}

void OhcLimits::detect(const Frame& frame, OhcCandidates& candidates, ContactSet& contacts) {
    const Topology& topology = bodies_.topology();
    tested_.clear();
    const double query_distance = bodies_.query_distance();
    candidates.once = last_pairs_;
    candidates.once.insert(candidates.once.end(), last_near_.begin(), last_near_.end());
    candidates.repeated.clear();
    const auto flush = [&] {
        candidates.once.insert(candidates.once.end(), candidates.repeated.begin(), candidates.repeated.end());
        candidates.repeated.clear();
        for (const TrianglePair& pair : candidates.once) {
            const auto place = std::lower_bound(tested_.begin(), tested_.end(), pair);
            if (place != tested_.end() && *place == pair) continue;
            if (bodies_.cells().path()) {
                if (!work_.spend(work_.counters.box_tests, 1)) return false;
                if (!may_meet_on_path(topology, frame, pair, query_distance)) continue;
            }
            const std::size_t meeting = contacts.pairs.size();
            if (work_.truncated || !work_.spend(work_.counters.triangle_tests, 1)) return false;
            tested_.insert(place, pair);
            test_pairs(settings_.test, topology, frame, {&pair, 1}, contacts.pairs);
            if (query_distance > 0.0 && contacts.pairs.size() == meeting) {
                if (!work_.spend(work_.counters.triangle_tests, 1)) return false;
                if (is_near(topology, frame, pair, query_distance)) contacts.near.push_back(pair);
            }
            if (!bodies_.cells().path() || !either_moved(topology, frame, pair)) continue;
            if (!work_.spend(work_.counters.triangle_tests, 1)) return false;
            test_swept(topology, frame, {&pair, 1}, contacts.swept);
        }
        candidates.once.clear();
        return true;
    };
    const auto is_instrument = [this](Index body) { return bodies_.body(body).kind == BodyKind::instrument; };
    const bool cut_before = std::exchange(work_.truncated, false);
    if (flush() && !cut_before) {
        maps_.hash(frame);
        for (const bool instruments : {true, false}) {
            const auto wanted = [&](Index a, Index b) { return (is_instrument(a) || is_instrument(b)) == instruments; };
            if (!work_.truncated) maps_.gather(wanted, flush, candidates);
            if (!work_.truncated) maps_.gather_huge(frame, wanted, candidates);
            if (!work_.truncated) flush();
        }
    }
    work_.truncated = work_.truncated || cut_before;
    last_pairs_ = contacts.pairs;
    last_near_ = contacts.near;
    std::sort(last_pairs_.begin(), last_pairs_.end());
    std::sort(last_near_.begin(), last_near_.end());
}

}  // namespace trocar
