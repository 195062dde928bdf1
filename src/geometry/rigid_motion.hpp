#pragma once

#include "geometry/types.hpp"

namespace trocar {

struct RigidMotion {
    Matrix3 rotation = Matrix3::Identity();
    Vector3 translation = Vector3::Zero();  ///< m, after the rotation
};

/// Places every column: p' = R p + t. Evaluates row by row, x then y then z, so that bits do not depend on the
/// compiler.
void transform_points(const Matrix3& rotation, const Vector3& translation, Eigen::Ref<Matrix3X> points);

/// Rigid motion that maps `from` nearest to `to` in least squares (both 3×n, m, n >= 1). Computed by the SVD of the
/// covariance (W. Kabsch 1976, "A solution for the best rotation to relate two sets of vectors"). Returns any one of
/// the solutions where the points are fewer than three or lie on a line.
RigidMotion rigid_motion(const Eigen::Ref<const Matrix3X>& from, const Eigen::Ref<const Matrix3X>& to);

}  // namespace trocar
