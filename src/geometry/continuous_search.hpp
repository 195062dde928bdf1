// Second stage of the continuous test: finds, in order of time, the roots at which two features may meet. Bisects the
// coplanarity polynomial in Bernstein form (a cubic; Provot 1997), in double first, then in double-double where it is
// too flat.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "geometry/continuous_coplanarity.hpp"
#include "geometry/continuous_features.hpp"

namespace trocar::continuous {

/// Bisects the tick until the cubic has no root or one with a monotone piece, and encloses that root by the slope.
class RootSearch {
public:
    void start(const Features& features) {
        features_ = &features;
        coplanarity_.reset();
        fine_ = false;
        search_from(features.coplanarity, features.tolerance);
    }

    /// The next sight in order of time. No sight follows apart, coplanar or unknown.
    Sight next();
    /// Coplanarity of the features, made on first use.
    Coplanarity& coplanarity() {
        if (!coplanarity_) coplanarity_.emplace(*features_);
        return *coplanarity_;
    }

private:
    struct Piece {
        std::array<double, 4> c;
        double low;
        double width;
    };

    void search_from(const std::array<double, 4>& coplanarity, double tolerance) {
        // Halving adds at most three rounding errors of the largest coefficient per level.
        tolerance_ = 7.5 * tolerance;
        stack_[0] = {coplanarity, 0.0, 1.0};
        depth_ = 1;
    }
    void halve(const Piece& piece);
    Sight search();

    const Features* features_ = nullptr;
    double tolerance_ = 0.0;
    bool fine_ = false;
    std::size_t depth_ = 0;
    std::array<Piece, 24> stack_;
    std::optional<Coplanarity> coplanarity_;
};

}  // namespace trocar::continuous
