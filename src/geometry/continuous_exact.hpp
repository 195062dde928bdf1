// Last stage of the continuous test: whether and when features meet, decided in integers of any size on the roots of
// the coplanarity polynomial. The oracle is this and nothing before it; the query (continuous.cpp) comes here when
// integers of fixed size do not report either. Everything in any motion is answered, at some 0.3 ms.
#pragma once

#include <array>
#include <optional>

#include "geometry/continuous.hpp"
#include "geometry/time_polynomial.hpp"

namespace trocar::continuous {

/// e · (u × w) of the features (continuous_features.hpp) times a power of two that makes all coordinates whole.
Polynomial volume_of(const std::array<MovingPoint, 4>& points, bool edges);
/// The earlier of two moments that need not exist.
std::optional<double> earlier(std::optional<double> a, std::optional<double> b);

/// first_contact of a vertex and a face's corners.
std::optional<double> exact_vertex_face(const std::array<MovingPoint, 4>& points);
/// first_contact of the ends of one edge and those of another.
std::optional<double> exact_edge_edge(const std::array<MovingPoint, 4>& points);

}  // namespace trocar::continuous
