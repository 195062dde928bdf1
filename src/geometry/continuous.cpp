// The query and the order of its stages. Features are the six vertex-face pairs and the nine edge-edge pairs of two
// triangles. Each stage passes on what it could not decide:
//
// * features: doubles with error bounds. Triangles on one side of a plane all the time are apart
//   (continuous_features.hpp).
// * search: encloses, in order, the times at which features are coplanar, and decides many of them
//   (continuous_search.hpp).
// * coplanarity: the exact time in double-double, boundary cases in integers of fixed size
//   (continuous_coplanarity.hpp, in the arithmetic of continuous_lines.hpp).
// * exclusion: for features without such a time, as those coplanar all the time: parts of time and place in which
//   they cannot touch (continuous_exclusion.hpp).
// * exact: integers of any size, on the roots of the polynomial (continuous_exact.hpp, time_polynomial.hpp).
//
// The oracle uses only exclusion and exact.
#include "geometry/continuous.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "geometry/continuous_exact.hpp"
#include "geometry/continuous_features.hpp"
#include "geometry/continuous_search.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

using continuous::Features;
using continuous::RootSearch;
using continuous::Sight;

std::optional<double> exactly(const Features& f) {
    return f.edges ? continuous::exact_edge_edge(f.copy()) : continuous::exact_vertex_face(f.copy());
}

/// First time at which features meet, from `sight` on; empty also when that is not before `known`. Precondition of
/// in_pair: the sets are apart at the start, and the vertex-face pairs are tested too. Coplanar edges are then skipped,
/// since an end of one arrives at the other first.
std::optional<double> first_moment(const Features& f, RootSearch& search, Sight sight, std::optional<double> known,
                                   bool in_pair) {
    using Verdict = Sight::Verdict;
    for (;; sight = search.next()) {
        if (sight.verdict == Verdict::apart) return std::nullopt;
        if (sight.verdict == Verdict::coplanar && in_pair && f.edges) return std::nullopt;
        if (sight.verdict != Verdict::hit && sight.verdict != Verdict::maybe) {
            if (known && sight.low >= *known) return std::nullopt;
            return exactly(f);
        }
        if (known && !search.coplanarity().root_is_before(*known, sight)) return std::nullopt;
        const std::int64_t n = search.coplanarity().rounded_root(sight);
        if (sight.verdict == Verdict::maybe) {
            const std::optional<bool> meets = search.coplanarity().meets(n, sight.before, in_pair);
            if (!meets) return exactly(f);
            if (!*meets) continue;
        }
        return std::ldexp(static_cast<double>(n), -continuous::time_bits);
    }
}

std::optional<double> time_of(const Features& f) {
    RootSearch search;
    search.start(f);
    const Sight sight = search.next();
    return first_moment(f, search, sight, std::nullopt, false);
}

bool swept_boxes_overlap(const MovingTriangle& first, const MovingTriangle& second) {
    std::array<Box, 2> swept;
    for (std::size_t i = 0; i < 3; ++i) {
        swept[0].add(first[i].start);
        swept[0].add(first[i].end);
        swept[1].add(second[i].start);
        swept[1].add(second[i].end);
    }
    return swept[0].overlaps(swept[1]);
}

bool overlap_at_start(const MovingTriangle& first, const MovingTriangle& second) {
    return triangles_intersect({first[0].start, first[1].start, first[2].start},
                               {second[0].start, second[1].start, second[2].start});
}

}  // namespace

std::optional<double> first_contact(const MovingPoint& vertex, const MovingTriangle& face) {
    return time_of(continuous::vertex_face_features(vertex, face));
}

std::optional<double> first_contact(const MovingEdge& first, const MovingEdge& second) {
    return time_of(continuous::edge_edge_features(first[0], first[1], second[0], second[1]));
}

std::optional<double> first_contact(const MovingTriangle& first, const MovingTriangle& second) {
    const std::optional<FirstMeeting> meeting = first_meeting(first, second);
    return meeting ? std::optional(meeting->time) : std::nullopt;
}

std::optional<FirstMeeting> first_meeting(const MovingTriangle& first, const MovingTriangle& second) {
    if (!swept_boxes_overlap(first, second)) return std::nullopt;
    // Vertices against faces first: three vertices on one side of a plane all the time separate the triangles.
    std::array<Features, 15> features;
    std::size_t count = 0;
    for (const bool swapped : {false, true}) {
        const MovingTriangle& vertices = swapped ? second : first;
        const MovingTriangle& face = swapped ? first : second;
        int sides = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            features[count] = continuous::vertex_face_features(vertices[i], face);
            sides += features[count++].sign();
        }
        if (sides == 3 || sides == -3) return std::nullopt;
    }
    if (overlap_at_start(first, second)) return FirstMeeting{0.0, Meeting::overlap_at_start};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            features[count++] =
                continuous::edge_edge_features(first[i], first[(i + 1) % 3], second[j], second[(j + 1) % 3]);
        }
    }
    // Exact times are computed only for features that may be first.
    std::array<RootSearch, 15> searches;
    std::array<Sight, 15> sights;
    double latest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k) {
        if (features[k].sign() != 0) continue;
        searches[k].start(features[k]);
        sights[k] = searches[k].next();
        if (sights[k].verdict == Sight::Verdict::hit) latest = std::min(latest, sights[k].high);
    }
    std::optional<FirstMeeting> best;
    for (std::size_t k = 0; k < count; ++k) {
        if (sights[k].verdict == Sight::Verdict::apart || sights[k].low > latest) continue;
        const std::optional<double> known = best ? std::optional(best->time) : std::nullopt;
        const std::optional<double> time = first_moment(features[k], searches[k], sights[k], known, true);
        if (!time || (best && best->time <= *time)) continue;
        best = FirstMeeting{*time, features[k].edges ? Meeting::edge_edge : Meeting::vertex_face};
        latest = std::min(latest, *time);
    }
    return best;
}

std::optional<double> oracle_first_contact(const MovingPoint& vertex, const MovingTriangle& face) {
    return continuous::exact_vertex_face({vertex, face[0], face[1], face[2]});
}

std::optional<double> oracle_first_contact(const MovingEdge& first, const MovingEdge& second) {
    return continuous::exact_edge_edge({first[0], first[1], second[0], second[1]});
}

std::optional<double> oracle_first_contact(const MovingTriangle& first, const MovingTriangle& second) {
    if (overlap_at_start(first, second)) return 0.0;
    if (!swept_boxes_overlap(first, second)) return std::nullopt;
    std::optional<double> time;
    for (std::size_t i = 0; i < 3; ++i) {
        time = continuous::earlier(time, oracle_first_contact(first[i], second));
        time = continuous::earlier(time, oracle_first_contact(second[i], first));
        for (std::size_t j = 0; j < 3; ++j) {
            time = continuous::earlier(time, oracle_first_contact(MovingEdge{first[i], first[(i + 1) % 3]},
                                                                  MovingEdge{second[j], second[(j + 1) % 3]}));
        }
    }
    return time;
}

}  // namespace trocar
