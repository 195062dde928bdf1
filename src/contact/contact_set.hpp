// The result of one tick's detection, reused from tick to tick: cleared, never freed. Also the work counters that CI
// may gate on, since they are deterministic where wall time is not.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact.hpp"
#include "contact/outcome.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// Deterministic counts of what a method examined in one tick.
struct WorkCounters {
    std::int64_t vertices_read = 0;
    std::int64_t cells_visited = 0;
    std::int64_t box_tests = 0;
    std::int64_t triangle_tests = 0;
    [[nodiscard]] std::int64_t work() const { return vertices_read + cells_visited + box_tests + triangle_tests; }
    WorkCounters& operator+=(const WorkCounters& other);
};

/// A detector fills pairs (sorted by (a, b), each once), within a reach also the near ones, optionally native contacts,
/// and the counters; the contact generator fills contacts. Pairs name only triangles of body pairs that the
/// topology lists.
struct ContactSet {
    std::vector<TrianglePair> pairs;  ///< triangles that meet, whatever the query distance
    /// Triangles that do not meet and whose distance is at most `query_distance` (geometry/triangle_distance.hpp);
    /// sorted by (a, b), each once, none of them in `pairs`; empty at reach 0.
    std::vector<TrianglePair> near;
    double query_distance = 0.0;  ///< m, that the detector answered within; 0: meeting pairs only
    std::vector<Contact> native;  ///< the library's own contacts, kept raw
    /// Contacts that begin between the frames; only a detector with such an option fills it. Sorted by (a, b, body_a,
    /// body_b), each once; never part of `pairs`.
    std::vector<SweptContact> swept;
    std::vector<Contact> contacts;  ///< what the source made of the answer; its order is the source's
    WorkCounters work;
    /// Set by the caller: whether a method that has native contacts shall compute them. Off where only pairs are asked
    /// for, so that nobody pays for answers that nobody reads; clear() leaves it alone.
    bool native_wanted = true;
    bool truncated = false;  ///< a limit cut the list: "unknown", never "free"
    Outcome outcome;

    /// Empties everything and keeps the memory.
    void clear();
    /// Puts the smaller number first in each pair, sorts and drops repeats; for `pairs`, and for `proximity`.
    void sort_pairs();
    void sort_near();
};

}  // namespace trocar
