#include "geometry/rigid_motion.hpp"

#include <Eigen/SVD>

namespace trocar {

void transform_points(const Matrix3& rotation, const Vector3& translation, Eigen::Ref<Matrix3X> points) {
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
        const Vector3 p = points.col(i);
        for (int row = 0; row < 3; ++row) {
            points(row, i) =
                rotation(row, 0) * p.x() + rotation(row, 1) * p.y() + rotation(row, 2) * p.z() + translation[row];
        }
    }
}

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
