#include "geometry/rigid_motion.hpp"

#include <Eigen/SVD>

namespace trocar {

RigidMotion rigid_motion(const Eigen::Ref<const Matrix3X>& from, const Eigen::Ref<const Matrix3X>& to) {
    const Vector3 from_middle = from.rowwise().mean();
    const Vector3 to_middle = to.rowwise().mean();
    const Matrix3 covariance = (to.colwise() - to_middle) * (from.colwise() - from_middle).transpose();
    const Eigen::JacobiSVD<Matrix3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector3 signs = Vector3::Ones();
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) signs.z() = -1.0;
    RigidMotion motion{.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose()};
    motion.translation = to_middle - motion.rotation * from_middle;
    return motion;
}

}  // namespace trocar
