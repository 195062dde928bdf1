// Last stage of the continuous test: whether and when features meet, decided in integers of any size on the roots of
// the coplanarity polynomial. The oracle uses only this stage, after exclusion (continuous_exclusion.hpp). The query
// (continuous.cpp) uses it when integers of fixed size do not decide. Decides every motion, in about 0.3 ms.
#pragma once

#include <array>
#include <optional>

#include "geometry/continuous.hpp"
#include "geometry/time_polynomial.hpp"

namespace trocar::continuous {

/// e · (u × w) of the features (continuous_features.hpp), scaled by a power of two that makes all coordinates integer.
Polynomial volume_of(const std::array<MovingPoint, 4>& points, bool edges);
/// The earlier of two times, either of which may be empty.
std::optional<double> earlier(std::optional<double> a, std::optional<double> b);

/// first_contact of a vertex and a face: points are the vertex, then the face's corners.
std::optional<double> exact_vertex_face(const std::array<MovingPoint, 4>& points);
/// first_contact of two edges: points are the ends of the first, then those of the second.
std::optional<double> exact_edge_edge(const std::array<MovingPoint, 4>& points);

}  // namespace trocar::continuous
