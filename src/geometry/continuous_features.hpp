// First stage of the continuous test: two features (vertex and face, or edge and edge) as the query follows them, and
// what plain doubles with error bounds can report them: on which side, and whether they meet at a known moment.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "geometry/continuous.hpp"

namespace trocar::continuous {

/// Two features on their way, as offset + place on the one = place on the other: e = α u + β w (vertex and face, α and
/// β >= 0, α + β <= 1) or e = α u - β w (edges, α and β in [0, 1]). Coplanar where e · (u × w) = 0.
struct Features {
    const MovingPoint* points[4];  ///< vertex, face; or edge, edge
    bool edges = false;
    MovingPoint e;
    MovingPoint u;
    MovingPoint w;
    double size_e = 0.0;  ///< largest coordinate of the difference at either end
    double size_u = 0.0;
    double size_w = 0.0;
    std::array<double, 4> coplanarity{};  ///< Bernstein coefficients of e · (u × w) over the tick
    double tolerance = 0.0;               ///< bound on the rounding error of a coefficient; < 0: none can be given
    double scale = 1.0;                   ///< a power of two that e, u, w and what follows from them are scaled by

    [[nodiscard]] std::array<MovingPoint, 4> copy() const { return {*points[0], *points[1], *points[2], *points[3]}; }
    /// +1 or -1 when the coplanarity has this sign all the time, without doubt.
    [[nodiscard]] int sign() const {
        if (tolerance < 0.0) return 0;
        const auto [low, high] = std::minmax({coplanarity[0], coplanarity[1], coplanarity[2], coplanarity[3]});
        if (low > tolerance) return 1;
        return high < -tolerance ? -1 : 0;
    }
};

Features vertex_face_features(const MovingPoint& vertex, const MovingTriangle& face);
Features edge_edge_features(const MovingPoint& a, const MovingPoint& b, const MovingPoint& c, const MovingPoint& d);

/// What floating point can report the next moment at which the features may meet.
struct Sight {
    enum class Verdict : std::uint8_t {
        apart,     ///< there is none
        hit,       ///< they meet at the only root of the coplanarity in [low, high]
        maybe,     ///< there is one such root, and they may meet there
        coplanar,  ///< all the time
        unknown    ///< not before low
    };
    Verdict verdict = Verdict::apart;
    double low = 0.0;
    double high = 1.0;
    int before = 0;  ///< hit, maybe: sign of the coplanarity before the root; the other one after it
};

/// Whether the features meet at a coplanar moment within `half` of `time`: +1 yes, -1 no, 0 not certain.
int meet_at(const Features& f, double time, double half);

}  // namespace trocar::continuous
