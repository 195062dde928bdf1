#include "tissue/stability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tissue/shape_forces.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Linearised stiffness of one spring: slope of its tension along it, tension over length across it (thesis §3.2,
/// preload).
Matrix3 stiffness_block(const Spring& spring, const Matrix3X& position) {
    const Vector3 d = position.col(spring.j) - position.col(spring.i);
    const double length = d.norm();
    if (length == 0.0) return spring.k * Matrix3::Identity();
    const Vector3 u = d / length;
    double tension = spring.k * (length - spring.rest) + spring.preload;
    double slope = spring.k;
    if (const double more = stiffening_tension(spring, length); more > 0.0) {
        tension += more;
        slope += 3.0 * more / (length - spring.rest);
    }
    const Matrix3 along = u * u.transpose();
    return slope * along + tension / length * (Matrix3::Identity() - along);
}

ShapeElements shape_of(const Materials& materials) {
    return {.stiffening = {}, .hinges = materials.hinges, .enclosures = materials.enclosures};
}

bool has_shape(const Materials& materials) { return !materials.hinges.empty() || !materials.enclosures.empty(); }

}  // namespace

bool is_free(const Materials& materials, Index vertex) {
    return materials.mass[at(vertex)] > 0.0 && (materials.pinned.empty() || materials.pinned[at(vertex)] == 0);
}

double gershgorin_bound_omega(const Materials& materials, const Matrix3X& position,
                              std::span<const double> contact_stiffness) {
    const Eigen::Index n = position.cols();
    std::vector<Matrix3> diagonal(static_cast<std::size_t>(n), Matrix3::Zero());
    Matrix3X off_diagonal = Matrix3X::Zero(3, n);
    for (const Spring& spring : materials.springs) {
        const Matrix3 block = stiffness_block(spring, position);
        diagonal[at(spring.i)] += block;
        diagonal[at(spring.j)] += block;
        if (is_free(materials, spring.i) && is_free(materials, spring.j)) {
            const Vector3 sums = block.cwiseAbs().rowwise().sum();
            off_diagonal.col(spring.i) += sums;
            off_diagonal.col(spring.j) += sums;
        }
    }
    if (has_shape(materials)) {
        std::vector<double> inverse_mass(static_cast<std::size_t>(n), 0.0);
        for (Index v = 0; v < n; ++v) {
            if (is_free(materials, v)) inverse_mass[at(v)] = 1.0 / materials.mass[at(v)];
        }
        add_shape_row_sums(shape_of(materials), position, inverse_mass, off_diagonal);
    }
    double largest = 0.0;
    for (Index v = 0; v < n; ++v) {
        if (!is_free(materials, v)) continue;
        Matrix3 block = diagonal[at(v)];
        if (!contact_stiffness.empty()) block += contact_stiffness[at(v)] * Matrix3::Identity();
        const Vector3 rows = block.cwiseAbs().rowwise().sum() + off_diagonal.col(v);
        largest = std::max(largest, rows.maxCoeff() / materials.mass[at(v)]);
    }
    return std::sqrt(largest);
}

void apply_stiffness(const Materials& materials, const Matrix3X& position, const Matrix3X& displacement,
                     Matrix3X& force) {
    force.setZero(3, position.cols());
    for (const Spring& spring : materials.springs) {
        const bool free_i = is_free(materials, spring.i);
        const bool free_j = is_free(materials, spring.j);
        Vector3 difference = Vector3::Zero();
        if (free_i) difference += displacement.col(spring.i);
        if (free_j) difference -= displacement.col(spring.j);
        const Vector3 f = stiffness_block(spring, position) * difference;
        if (free_i) force.col(spring.i) += f;
        if (free_j) force.col(spring.j) -= f;
    }
    if (!has_shape(materials)) return;
    Matrix3X free_part = displacement;
    Matrix3X shape_force = Matrix3X::Zero(3, position.cols());
    for (Index v = 0; v < position.cols(); ++v) {
        if (!is_free(materials, v)) free_part.col(v).setZero();
    }
    add_shape_stiffness(shape_of(materials), position, free_part, shape_force);
    for (Index v = 0; v < position.cols(); ++v) {
        if (is_free(materials, v)) force.col(v) += shape_force.col(v);
    }
}

double critical_time_step(double omega, double damping_rate) {
    const double sum = damping_rate + std::sqrt(damping_rate * damping_rate + 4.0 * omega * omega);
    // The data's formula with numerator and denominator multiplied by `sum`, which avoids the cancellation.
    return 4.0 / sum;
}

int stable_substeps(const Materials& materials, const Matrix3X& position, double dt) {
    const double omega = gershgorin_bound_omega(materials, position);
    std::vector<double> damping = materials.drag;
    damping.resize(static_cast<std::size_t>(position.cols()), 0.0);
    for (const Spring& spring : materials.springs) {
        // |c u uᵀ| has row sums up to sqrt(3) c per block; two blocks per row.
        const double row = 2.0 * std::sqrt(3.0) * spring.damping;
        damping[at(spring.i)] += row;
        damping[at(spring.j)] += row;
    }
    double damping_rate = 0.0;
    for (Index v = 0; v < position.cols(); ++v) {
        if (is_free(materials, v)) damping_rate = std::max(damping_rate, damping[at(v)] / materials.mass[at(v)]);
    }
    if (omega == 0.0 && damping_rate == 0.0) return 1;
    const double limit = 0.95 * critical_time_step(omega, damping_rate);
    return std::max(1, static_cast<int>(std::ceil(std::min(dt / limit, 1e6))));
}

bool surely_unstable(const Materials& materials, const Matrix3X& position, double h) {
    // The scheme at the growth factor z = -1: 4 M - h² K - 2 h C. It is positive definite for z towards minus infinity,
    // so that any displacement that makes it negative proves a root z < -1.
    const Eigen::Index n = position.cols();
    Matrix3X shape(3, n);
    for (Eigen::Index i = 0; i < shape.size(); ++i) {
        shape.data()[i] = std::sin(1.0 + 0.754877666 * static_cast<double>(i * i + i));
    }
    for (Index v = 0; v < n; ++v) {
        if (!is_free(materials, v)) shape.col(v).setZero();
    }
    Matrix3X image(3, n);
    constexpr int most_iterations = 100;
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        apply_stiffness(materials, position, shape, image);
        image *= h * h;
        for (const Spring& spring : materials.springs) {
            const Vector3 d = position.col(spring.j) - position.col(spring.i);
            if (spring.damping == 0.0 || d.squaredNorm() == 0.0) continue;
            const Vector3 u = d.normalized();
            const Vector3 f = 2.0 * h * spring.damping * u.dot(shape.col(spring.i) - shape.col(spring.j)) * u;
            if (is_free(materials, spring.i)) image.col(spring.i) += f;
            if (is_free(materials, spring.j)) image.col(spring.j) -= f;
        }
        double mass = 0.0;
        for (Index v = 0; v < n; ++v) {
            if (!is_free(materials, v)) continue;
            if (!materials.drag.empty()) image.col(v) += 2.0 * h * materials.drag[at(v)] * shape.col(v);
            mass += materials.mass[at(v)] * shape.col(v).squaredNorm();
        }
        if (mass == 0.0) return false;
        if (shape.cwiseProduct(image).sum() > 4.0 * mass) return true;
        for (Index v = 0; v < n; ++v) {
            if (is_free(materials, v)) shape.col(v) = image.col(v) / materials.mass[at(v)];
        }
        const double size = shape.cwiseAbs().maxCoeff();
        if (!(size > 0.0) || !std::isfinite(size)) return false;
        shape /= size;
    }
    return false;
}

}  // namespace trocar
