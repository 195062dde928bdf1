#include "tissue/volume_system.hpp"

namespace trocar {
VolumeSystem::VolumeSystem(MovingTissue& tissue) : tissue_(&tissue) {
    if (tissue.volumes().none()) return;
    const auto columns = static_cast<Eigen::Index>(tissue.state().size());
    enclosures_.resize(tissue.volumes().linear().size());
    for (Enclosed& one : enclosures_) {
        one.gradient.setZero(4, columns);
        one.answer.setZero(4, columns);
    }
    moved_.setZero(3, columns);
    product_.setZero(3, columns);
}

void VolumeSystem::add_to(double h, SpringSystem& system) {
    VolumeForces& volumes = tissue_->volumes();
    if (volumes.none()) return;
    const TissueState& state = tissue_->state();
    volumes.linearise(state.position.topRows<3>());
    // Subtracts h² K v of the free vertices.
    for (std::size_t v = 0; v < state.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        moved_.col(column) = state.velocity.col(column).head<3>();
        if (state.inverse_mass[v] == 0.0) moved_.col(column).setZero();
    }
    product_.setZero();
    volumes.add_product(moved_, product_);
    for (std::size_t v = 0; v < state.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        if (state.inverse_mass[v] != 0.0) system.right_side.col(column).head<3>() -= h * h * product_.col(column);
    }
}

void VolumeSystem::prepare_enclosures(double h, const SpringSystem& system, double tolerance, int iterations,
                                      ConjugateGradients& gradients) {
    const TissueState& state = tissue_->state();
    for (std::size_t e = 0; e < enclosures_.size(); ++e) {
        Enclosed& one = enclosures_[e];
        const VolumeForces::LinearEnclosure& linear = tissue_->volumes().linear()[e];
        for (std::size_t n = 0; n < linear.vertex.size(); ++n) {
            auto column = one.gradient.col(linear.vertex[n]).head<3>();
            column.setZero();
            if (state.moves(linear.vertex[n])) column = linear.gradient.col(static_cast<Eigen::Index>(n));
        }
        gradients.solve(tissue_->spring_arrays(), system, one.gradient, tolerance, iterations, one.answer);
        const double stiffness = h * h * linear.stiffness;
        one.factor = stiffness / (1.0 + stiffness * one.gradient.cwiseProduct(one.answer).sum());
    }
}

void VolumeSystem::enclose(Matrix4X& change) const {
    for (const Enclosed& one : enclosures_) {
        change -= one.factor * one.gradient.cwiseProduct(change).sum() * one.answer;
    }
}

}  // namespace trocar
