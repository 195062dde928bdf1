// Narrow phase of the project's detectors: which candidate pairs intersect, or are within the query distance. All
// cascades share this test, and a study can replace it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "contact/contact.hpp"
#include "detect/triangle_filter.hpp"
#include "scene/world.hpp"

namespace trocar {

/// exact: float filter in vectors (triangle_filter.hpp), exact predicates for the rest. interval: double with relative
/// tolerance. moller: the float reference routine with its known failures (METHODS §3.3).
enum class TriangleTest : std::uint8_t { exact, interval, moller };
/// Parses "exact", "interval" or "moller".
TriangleTest triangle_test_from(std::string_view word);

/// Appends those of `candidates` that intersect to `pairs`, in the same order. `filter` affects only the time.
void test_pairs(TriangleTest test, const Topology& topology, const Frame& frame,
                std::span<const TrianglePair> candidates, std::vector<TrianglePair>& pairs,
                const TriangleFilter& filter = triangle_filters().front());

/// As test_pairs; appends those of the others that are at most `query_distance` (m) apart to `proximity`. Returns the
/// number of distance tests, 0 when `query_distance` is 0.
std::int64_t test_pairs_within(double query_distance, TriangleTest test, const Topology& topology, const Frame& frame,
                               std::span<const TrianglePair> candidates, std::vector<TrianglePair>& pairs,
                               std::vector<TrianglePair>& near,
                               const TriangleFilter& filter = triangle_filters().front());

/// Whether two triangles that do not meet are at most `query_distance` (m) apart.
bool is_near(const Topology& topology, const Frame& frame, const TrianglePair& pair, double query_distance);

}  // namespace trocar
