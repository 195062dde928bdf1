// Result of one tick's detection. Buffers are cleared every tick and never freed. The work counters are deterministic,
// so that CI can gate on them.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact.hpp"
#include "contact/outcome.hpp"
#include "geometry/types.hpp"

namespace trocar {

struct WorkCounters {
    std::int64_t vertices_read = 0;
    std::int64_t cells_visited = 0;
    std::int64_t box_tests = 0;
    std::int64_t triangle_tests = 0;
    [[nodiscard]] std::int64_t work() const { return vertices_read + cells_visited + box_tests + triangle_tests; }
    WorkCounters& operator+=(const WorkCounters& other);
};

/// A detector fills `pairs`, `near` if the query distance is > 0, the counters, and optionally `native` and `swept`.
/// The contact generator fills `contacts`. Pairs are sorted by (a, b), unique, and only of the topology's body pairs.
struct ContactSet {
    std::vector<TrianglePair> pairs;  ///< intersecting triangles, whatever the query distance
    /// Disjoint triangles at most `query_distance` apart (geometry/triangle_distance.hpp); empty at query distance 0.
    std::vector<TrianglePair> near;
    double query_distance = 0.0;  ///< m, of the detector's answer; 0: intersecting pairs only
    std::vector<Contact> native;  ///< the library's own contacts, unmodified
    /// Contacts that begin between the frames, from detectors with that option; not included in `pairs`. Sorted by (a,
    /// b, body_a, body_b), unique.
    std::vector<SweptContact> swept;
    std::vector<Contact> contacts;  ///< output of the contact generator, in the generator's order
    WorkCounters work;
    /// Set by the caller: false lets detectors skip native contacts. clear() keeps it.
    bool native_wanted = true;
    bool truncated = false;  ///< a limit cut the list: an absent pair means "unknown", not "free"
    Outcome outcome;

    /// Keeps the memory and `native_wanted`.
    void clear();
    /// Replaces the detector's answer by an empty one that was found to the query distance, with the outcome `ok`.
    void answer_nothing();
    /// Orders each pair so that a < b, sorts and removes duplicates, in `pairs` and in `near`.
    void sort();
};

}  // namespace trocar
