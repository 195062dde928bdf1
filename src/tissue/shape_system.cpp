#include "tissue/shape_system.hpp"

namespace trocar {
ShapeSystem::ShapeSystem(MovingTissue& tissue) : tissue_(&tissue) {
    if (tissue.shape().none()) return;
    const auto columns = static_cast<Eigen::Index>(tissue.state().size());
    for (std::size_t s = 0; s < tissue.springs().size(); ++s) {
        if (tissue.springs()[s].stiffening > 0.0) stiffening_.push_back(s);
    }
    enclosures_.resize(tissue.shape().linear_enclosures().size());
    for (Enclosed& one : enclosures_) {
        one.gradient.setZero(4, columns);
        one.answer.setZero(4, columns);
    }
    moved_.setZero(3, columns);
    product_.setZero(3, columns);
}

void ShapeSystem::add_to(double h, SpringSystem& system) {
    ShapeForces& shape = tissue_->shape();
    if (shape.none()) return;
    const TissueState& state = tissue_->state();
    shape.linearise(state.position.topRows<3>());
    for (const std::size_t s : stiffening_) {
        const Spring& spring = tissue_->springs()[s];
        const Index i = state.place[at(spring.i)];
        const Index j = state.place[at(spring.j)];
        const double length = (state.position.col(j) - state.position.col(i)).norm();
        const double tension = stiffening_tension(spring, length);
        if (tension == 0.0) continue;
        const double across = h * h * tension / length;
        system.alpha[s] += h * h * 3.0 * tension / (length - spring.rest) - across;
        system.beta[s] += across;
    }
    for (std::size_t n = 0; n < system.hinges.size(); ++n) {
        const ShapeForces::LinearHinge& linear = shape.linear_hinges()[n];
        SystemHinge& hinge = system.hinges[n];
        hinge.stiffness = h * h * linear.stiffness;
        for (std::size_t corner = 0; corner < 4; ++corner) {
            hinge.slope[corner] = state.moves(hinge.vertex[corner]) ? linear.slope[corner] : Vector3(Vector3::Zero());
        }
    }
    // - h² K v of what moves.
    for (std::size_t v = 0; v < state.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        moved_.col(column) = state.velocity.col(column).head<3>();
        if (state.inverse_mass[v] == 0.0) moved_.col(column).setZero();
    }
    product_.setZero();
    shape.add_product(moved_, product_);
    for (std::size_t v = 0; v < state.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        if (state.inverse_mass[v] != 0.0) system.right_side.col(column).head<3>() -= h * h * product_.col(column);
    }
}

void ShapeSystem::prepare_enclosures(double h, const SpringSystem& system, double tolerance, int iterations,
                                     ConjugateGradients& gradients) {
    const TissueState& state = tissue_->state();
    for (std::size_t e = 0; e < enclosures_.size(); ++e) {
        Enclosed& one = enclosures_[e];
        const ShapeForces::LinearEnclosure& linear = tissue_->shape().linear_enclosures()[e];
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

void ShapeSystem::enclose(Matrix4X& change) const {
    for (const Enclosed& one : enclosures_) {
        change -= one.factor * one.gradient.cwiseProduct(change).sum() * one.answer;
    }
}

}  // namespace trocar
