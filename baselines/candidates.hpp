// Shared by baselines that find overlapping boxes only: outward rounding to float, and the exact triangle test of
// candidates. All use this project's narrow phase, so that only broad phases differ.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "contact/contact_set.hpp"
#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"
#include "scene/world.hpp"

namespace trocar::baselines {

/// Float not above (round_down) or not below (round_up) the value, within two units in the last place. Narrowed boxes
/// therefore never shrink. Branch-free, since the rounding direction is unpredictable for the branch predictor.
inline float round_down(double value) {
    constexpr float largest = std::numeric_limits<float>::max();
    auto narrowed = static_cast<float>(value);
    narrowed = narrowed < largest ? narrowed : largest;
    return narrowed - (std::fabs(narrowed) * 0x1p-23F + std::numeric_limits<float>::min());
}
inline float round_up(double value) { return -round_down(-value); }

using Float4 = float __attribute__((vector_size(16)));

/// Box in floats; the fourth components are equal and unused.
struct FloatBox {
    Float4 low;
    Float4 high;
    void add(const FloatBox& other) {
        low = low < other.low ? low : other.low;
        high = high < other.high ? other.high : high;
    }
    [[nodiscard]] bool overlaps(const FloatBox& other) const {
        const auto apart = (low > other.high) | (other.low > high);
        return (apart[0] | apart[1] | apart[2]) == 0;
    }
};

/// Vertices of a tick rounded to float once, for baselines with float boxes. A vertex belongs to six triangles on
/// average.
class FloatVertices {
public:
    /// Rounds all vertices of the frame; allocates at the first call only.
    void narrow(const Frame& frame) {
        constexpr float largest = std::numeric_limits<float>::max();
        const auto count = static_cast<std::size_t>(frame.position.cols());
        points_.resize(count);
        const double* p = frame.position.data();
        for (std::size_t v = 0; v < count; ++v, p += 3) {
            Float4 point{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 0.0F};
            point = point < largest ? point : Float4{} + largest;
            points_[v] = point > -largest ? point : Float4{} - largest;
        }
    }
    /// Float box that contains the exact box. Rounding is monotone, so one widening by more than the rounding error
    /// suffices. `around`: m, >= 0, added on all sides.
    [[nodiscard]] FloatBox box_of(const Topology& topology, Index triangle, double around = 0.0) const {
        const Index* const corner = topology.triangles.data() + 3 * static_cast<std::ptrdiff_t>(triangle);
        const Float4 a = points_[static_cast<std::size_t>(corner[0])];
        const Float4 b = points_[static_cast<std::size_t>(corner[1])];
        const Float4 c = points_[static_cast<std::size_t>(corner[2])];
        Float4 low = a < b ? a : b;
        Float4 high = a < b ? b : a;
        low = low < c ? low : c;
        high = high < c ? c : high;
        if (around == 0.0) return {low - slack(low), high + slack(high)};
        // Two further roundings: the sum with `around`, and the box with the sum.
        const float wider = round_up(around) * (1.0F + 0x1p-20F);
        return {low - (2.0F * slack(low) + wider), high + (2.0F * slack(high) + wider)};
    }

private:
    static Float4 slack(Float4 x) { return (x < 0.0F ? -x : x) * 0x1p-23F + std::numeric_limits<float>::min(); }
    std::vector<Float4> points_;
};

/// Box of the vertices of a body with triangles, to select body pairs for queries. Vertices outside any triangle only
/// enlarge it.
inline Box box_of_body(const Frame& frame, const BodyRange& body) {
    return body.triangles.count == 0 ? Box{} : box_of(frame.position, body.vertices);
}

/// True unless the frame reports the body at rest. All baselines skip bodies at rest.
inline bool may_have_moved(const Frame& frame, const BodyRange& body) {
    return !frame.moved || std::any_of(frame.moved->begin(), frame.moved->end(), [&body](Range moved) {
        return moved.first < body.vertices.end() && body.vertices.first < moved.end();
    });
}

/// Appends a pair to contacts.near when its triangles do not intersect and are at most `query_distance` (query
/// distance, m) apart.
inline void test_near(const Topology& topology, const Frame& frame, TrianglePair pair, double query_distance,
                      ContactSet& contacts) {
    ++contacts.work.triangle_tests;
    const Corners first = corners_of(topology.triangles, frame.position, pair.a);
    const Corners second = corners_of(topology.triangles, frame.position, pair.b);
    if (is_within_query_distance(first, second, query_distance) && !triangles_intersect(first, second))
        contacts.near.push_back(pair);
}

/// Exact test of one candidate. Appends it to contacts.pairs when the closed triangles intersect, else to contacts.near
/// when they are at most `contacts.query_distance` apart.
inline void test_candidate(const Topology& topology, const Frame& frame, Index a, Index b, ContactSet& contacts) {
    ++contacts.work.triangle_tests;
    const Corners first = corners_of(topology.triangles, frame.position, a);
    const Corners second = corners_of(topology.triangles, frame.position, b);
    if (triangles_intersect(first, second)) {
        contacts.pairs.push_back({a, b});
        return;
    }
    if (contacts.query_distance == 0.0) return;
    ++contacts.work.triangle_tests;
    if (is_within_query_distance(first, second, contacts.query_distance)) contacts.near.push_back({a, b});
}

}  // namespace trocar::baselines
