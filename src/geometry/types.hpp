// Linear-algebra types of the whole project: points, point arrays, triangle arrays and index ranges. A vertex array can
// be passed to any library without a copy.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace trocar {

using Index = std::int32_t;  ///< Vertex, triangle or body number; -1 means "not set".
/// A valid number as a subscript of the standard library's containers.
inline std::size_t at(std::ptrdiff_t number) { return static_cast<std::size_t>(number); }
/// A subscript as an index of Eigen.
inline Eigen::Index eigen_index(std::size_t number) { return static_cast<Eigen::Index>(number); }

/// A number that does not apply or that nobody has computed. Zero would pass for an answer.
inline constexpr double not_known = std::numeric_limits<double>::quiet_NaN();

using Vector3 = Eigen::Vector3d;  ///< Point, direction or force; world frame, SI units unless said otherwise.
using Matrix3 = Eigen::Matrix3d;
using Quaternion = Eigen::Quaterniond;
using Matrix3X = Eigen::Matrix3Xd;  ///< 3×N, column major: each point is 24 contiguous bytes.
using Triangles =
    Eigen::Matrix<Index, 3, Eigen::Dynamic>;  ///< 3×T vertex numbers, counter-clockwise seen from outside.

/// Half-open run of consecutive vertex, triangle or contact numbers.
struct Range {
    Index first = 0;
    Index count = 0;
    [[nodiscard]] Index end() const { return first + count; }
    [[nodiscard]] bool contains(Index i) const { return i >= first && i < end(); }
    bool operator==(const Range&) const = default;
};

/// Axis-aligned box; empty (min > max) until the first point is added.
struct Box {
    Vector3 min = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 max = Vector3::Constant(-std::numeric_limits<double>::infinity());
    void add(const Vector3& p) {
        min = min.cwiseMin(p);
        max = max.cwiseMax(p);
    }
    void add(const Box& other) {
        min = min.cwiseMin(other.min);
        max = max.cwiseMax(other.max);
    }
    /// Box enlarged by `around` (m) on all sides.
    [[nodiscard]] Box grown(double around) const {
        return {(min.array() - around).matrix(), (max.array() + around).matrix()};
    }
    /// m²; 0 inside.
    [[nodiscard]] double squared_distance(const Vector3& p) const {
        return (min - p).cwiseMax(p - max).cwiseMax(0.0).squaredNorm();
    }
    /// m², to the nearest point of another box; 0 where they overlap, infinite for an empty one.
    [[nodiscard]] double squared_distance(const Box& other) const {
        return (min - other.max).cwiseMax(other.min - max).cwiseMax(0.0).squaredNorm();
    }
    /// Closed boxes: touching counts as overlapping.
    [[nodiscard]] bool overlaps(const Box& other) const {
        return (min.array() <= other.max.array()).all() && (other.min.array() <= max.array()).all();
    }
};

/// Box of two points.
inline Box box_of(const Vector3& a, const Vector3& b) { return {a.cwiseMin(b), a.cwiseMax(b)}; }
/// Box of a run of `points` (3×N).
inline Box box_of(const Matrix3X& points, Range run) {
    Box box;
    for (Index i = run.first; i < run.end(); ++i) box.add(points.col(i));
    return box;
}

}  // namespace trocar
