// First stage of the continuous test: two features (vertex and face, or edge and edge), and decisions about them in
// plain doubles with error bounds.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "geometry/continuous.hpp"

namespace trocar::continuous {

/// Two moving features. A vertex and a face meet where e = α u + β w, α and β >= 0, α + β <= 1. Edges meet where e = α
/// u - β w, α and β in [0, 1]. Coplanar where e · (u × w) = 0.
struct Features {
    const MovingPoint* points[4];  ///< vertex, face; or edge, edge
    bool edges = false;
    MovingPoint e;
    MovingPoint u;
    MovingPoint w;
    double size_e = 0.0;  ///< largest coordinate of e at either end; likewise below
    double size_u = 0.0;
    double size_w = 0.0;
    std::array<double, 4> coplanarity{};  ///< Bernstein coefficients of e · (u × w) over the tick
    double tolerance = 0.0;               ///< bound on the rounding error of a coefficient; < 0: no bound exists
    double scale = 1.0;                   ///< a power of two that e, u, w and all derived numbers are scaled by

    [[nodiscard]] std::array<MovingPoint, 4> copy() const { return {*points[0], *points[1], *points[2], *points[3]}; }
    /// +1 or -1 when the coplanarity certainly has this sign all the time, else 0.
    [[nodiscard]] int sign() const {
        if (tolerance < 0.0) return 0;
        const auto [low, high] = std::minmax({coplanarity[0], coplanarity[1], coplanarity[2], coplanarity[3]});
        if (low > tolerance) return 1;
        return high < -tolerance ? -1 : 0;
    }
};

Features vertex_face_features(const MovingPoint& vertex, const MovingTriangle& face);
Features edge_edge_features(const MovingPoint& a, const MovingPoint& b, const MovingPoint& c, const MovingPoint& d);

/// Result of the floating-point search for the next time at which the features may meet.
struct Sight {
    enum class Verdict : std::uint8_t {
        apart,     ///< no such time is left
        hit,       ///< they meet at the only root of the coplanarity in [low, high]
        maybe,     ///< the coplanarity has one root in [low, high], and they may meet there
        coplanar,  ///< coplanar all the time
        unknown    ///< no contact before low; undecided after it
    };
    Verdict verdict = Verdict::apart;
    double low = 0.0;
    double high = 1.0;
    int before = 0;  ///< hit, maybe: sign of the coplanarity before the root; the opposite sign after it
};

/// Whether the features meet at a coplanar time within `half` of `time`: +1 yes, -1 no, 0 undecided.
int meet_at(const Features& f, double time, double half);

}  // namespace trocar::continuous
