#pragma once

#include "geometry/types.hpp"

namespace trocar {

struct RigidMotion {
    Matrix3 rotation = Matrix3::Identity();
    Vector3 translation = Vector3::Zero();  ///< m, after the rotation
};

/// The motion that takes the points `from` nearest to `to` (both 3×n, m, n >= 1; least squares; W. Kabsch 1976, "A
/// solution for the best rotation to relate two sets of vectors", by the SVD of the covariance). Where points leave the
/// rotation open (fewer than three, or all on a line), one of those that fit.
RigidMotion rigid_motion(const Eigen::Ref<const Matrix3X>& from, const Eigen::Ref<const Matrix3X>& to);

}  // namespace trocar
