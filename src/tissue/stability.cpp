#include "tissue/stability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "tissue/volume_forces.hpp"

namespace trocar {
namespace {

/// Linearised stiffness of one spring: slope of the tension along it, tension over length across it (thesis §3.2,
/// preload).
Matrix3 stiffness_block(const Spring& spring, const Matrix3X& position) {
    const Vector3 d = position.col(spring.j) - position.col(spring.i);
    const double length = d.norm();
    if (length == 0.0) return spring.k * Matrix3::Identity();
    const Vector3 u = d / length;
    const double tension = spring.k * (length - spring.rest) + spring.preload;
    const Matrix3 along = u * u.transpose();
    return spring.k * along + tension / length * (Matrix3::Identity() - along);
}

/// Longest h with squared h² + rate h <= 4. Numerator and denominator of the root are multiplied by `sum`, which avoids
/// cancellation.
double longest_step(double squared, double rate) {
    const double sum = rate + std::sqrt(rate * rate + 16.0 * squared);
    return sum > 0.0 ? 8.0 / sum : std::numeric_limits<double>::infinity();
}

/// Row sums of the absolute values of K and C over the free vertices, 3×N.
struct RowSums {
    Matrix3X stiffness;  ///< N/m
    Matrix3X damping;    ///< N s/m
};

/// `contact_stiffness` as in gershgorin_bound_omega.
RowSums row_sums(const Materials& materials, const Matrix3X& position, std::span<const double> contact_stiffness = {}) {
    const Eigen::Index n = position.cols();
    std::vector<Matrix3> stiffness(static_cast<std::size_t>(n), Matrix3::Zero());
    std::vector<Matrix3> damping(static_cast<std::size_t>(n), Matrix3::Zero());
    RowSums rows{Matrix3X::Zero(3, n), Matrix3X::Zero(3, n)};
    for (const Spring& spring : materials.springs) {
        const bool both = materials.is_free(spring.i) && materials.is_free(spring.j);
        const Vector3 u = (position.col(spring.j) - position.col(spring.i)).normalized();
        for (const auto& [block, diagonal, sums] :
             {std::tuple(stiffness_block(spring, position), &stiffness, &rows.stiffness),
              std::tuple(Matrix3(spring.damping * u * u.transpose()), &damping, &rows.damping)}) {
            for (const Index v : {spring.i, spring.j}) {
                (*diagonal)[at(v)] += block;
                if (both) sums->col(v) += block.cwiseAbs().rowwise().sum();
            }
        }
    }
    if (!materials.enclosures.empty()) {
        std::vector<double> inverse_mass(static_cast<std::size_t>(n), 0.0);
        for (Index v = 0; v < n; ++v) {
            if (materials.is_free(v)) inverse_mass[at(v)] = 1.0 / materials.mass[at(v)];
        }
        add_volume_row_sums(materials.enclosures, position, inverse_mass, rows.stiffness);
    }
    for (Index v = 0; v < n; ++v) {
        if (!contact_stiffness.empty()) stiffness[at(v)] += contact_stiffness[at(v)] * Matrix3::Identity();
        if (!materials.drag.empty()) damping[at(v)] += materials.drag[at(v)] * Matrix3::Identity();
        rows.stiffness.col(v) += stiffness[at(v)].cwiseAbs().rowwise().sum();
        rows.damping.col(v) += damping[at(v)].cwiseAbs().rowwise().sum();
    }
    return rows;
}

}  // namespace

double gershgorin_bound_omega(const Materials& materials, const Matrix3X& position,
                              std::span<const double> contact_stiffness) {
    const RowSums rows = row_sums(materials, position, contact_stiffness);
    double largest = 0.0;
    for (Index v = 0; v < position.cols(); ++v) {
        if (!materials.is_free(v)) continue;
        largest = std::max(largest, rows.stiffness.col(v).maxCoeff() / materials.mass[at(v)]);
    }
    return std::sqrt(largest);
}

void apply_stiffness(const Materials& materials, const Matrix3X& position, const Matrix3X& displacement,
                     Matrix3X& force) {
    force.setZero(3, position.cols());
    for (const Spring& spring : materials.springs) {
        const bool free_i = materials.is_free(spring.i);
        const bool free_j = materials.is_free(spring.j);
        Vector3 difference = Vector3::Zero();
        if (free_i) difference += displacement.col(spring.i);
        if (free_j) difference -= displacement.col(spring.j);
        const Vector3 f = stiffness_block(spring, position) * difference;
        if (free_i) force.col(spring.i) += f;
        if (free_j) force.col(spring.j) -= f;
    }
    if (materials.enclosures.empty()) return;
    Matrix3X free_part = displacement;
    Matrix3X volume_force = Matrix3X::Zero(3, position.cols());
    for (Index v = 0; v < position.cols(); ++v) {
        if (!materials.is_free(v)) free_part.col(v).setZero();
    }
    add_volume_stiffness(materials.enclosures, position, free_part, volume_force);
    for (Index v = 0; v < position.cols(); ++v) {
        if (materials.is_free(v)) force.col(v) += volume_force.col(v);
    }
}

double critical_time_step(double omega, double damping_rate) { return longest_step(omega * omega, 2.0 * damping_rate); }

int stable_substeps(const Materials& materials, const Matrix3X& position, double dt) {
    const double omega = gershgorin_bound_omega(materials, position);
    std::vector<double> damping = materials.drag;
    damping.resize(static_cast<std::size_t>(position.cols()), 0.0);
    for (const Spring& spring : materials.springs) {
        // c u uᵀ| has row sums up to sqrt(3) c per block; two blocks per row.
        const double row = 2.0 * std::sqrt(3.0) * spring.damping;
        damping[at(spring.i)] += row;
        damping[at(spring.j)] += row;
    }
    double damping_rate = 0.0;
    for (Index v = 0; v < position.cols(); ++v) {
        if (materials.is_free(v)) damping_rate = std::max(damping_rate, damping[at(v)] / materials.mass[at(v)]);
    }
    if (omega == 0.0 && damping_rate == 0.0) return 1;
    const double limit = 0.95 * critical_time_step(omega, damping_rate);
    return std::max(1, static_cast<int>(std::ceil(std::min(dt / limit, 1e6))));
}

namespace {

/// image += C shape over the free vertices.
void add_damping(const Materials& materials, const Matrix3X& position, const Matrix3X& shape, Matrix3X& image) {
    for (const Spring& spring : materials.springs) {
        const Vector3 d = position.col(spring.j) - position.col(spring.i);
        if (spring.damping == 0.0 || d.squaredNorm() == 0.0) continue;
        const Vector3 u = d.normalized();
        const Vector3 f = spring.damping * u.dot(shape.col(spring.i) - shape.col(spring.j)) * u;
        if (materials.is_free(spring.i)) image.col(spring.i) += f;
        if (materials.is_free(spring.j)) image.col(spring.j) -= f;
    }
    for (std::size_t v = 0; v < materials.drag.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        if (materials.is_free(static_cast<Index>(v))) image.col(column) += materials.drag[v] * shape.col(column);
    }
}

/// Smallest step that power iteration with h proves unstable; stops at the first step below `enough`.
double proven_unstable(const Materials& materials, const Matrix3X& position, double h, double enough) {
    // The scheme at the growth factor z = -1: 4 M - h² K - 2 h C. It is positive definite as z tends to minus infinity.
    // Any displacement that makes it negative therefore proves a root z < -1.
    const Eigen::Index n = position.cols();
    Matrix3X shape(3, n);
    for (Eigen::Index i = 0; i < shape.size(); ++i) {
        shape.data()[i] = std::sin(1.0 + 0.754877666 * static_cast<double>(i * i + i));
    }
    for (Index v = 0; v < n; ++v) {
        if (!materials.is_free(v)) shape.col(v).setZero();
    }
    Matrix3X stiff(3, n);
    Matrix3X damped(3, n);
    double smallest = std::numeric_limits<double>::infinity();
    constexpr int most_iterations = 100;
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        apply_stiffness(materials, position, shape, stiff);
        damped.setZero();
        add_damping(materials, position, shape, damped);
        double mass = 0.0;
        for (Index v = 0; v < n; ++v) {
            if (materials.is_free(v)) mass += materials.mass[at(v)] * shape.col(v).squaredNorm();
        }
        if (mass == 0.0) break;
        const double squared = std::max(0.0, shape.cwiseProduct(stiff).sum() / mass);
        const double rate = 2.0 * std::max(0.0, shape.cwiseProduct(damped).sum() / mass);
        smallest = std::min(smallest, longest_step(squared, rate));
        if (smallest < enough) break;
        for (Index v = 0; v < n; ++v) {
            if (materials.is_free(v)) {
                shape.col(v) = (h * h * stiff.col(v) + 2.0 * h * damped.col(v)) / materials.mass[at(v)];
            }
        }
        const double size = shape.cwiseAbs().maxCoeff();
        if (!(size > 0.0) || !std::isfinite(size)) break;
        shape /= size;
    }
    return smallest;
}

}  // namespace

bool surely_unstable(const Materials& materials, const Matrix3X& position, double h) {
    return proven_unstable(materials, position, h, h) < h;
}

double unstable_step(const Materials& materials, const Matrix3X& position, double h) {
    return proven_unstable(materials, position, h, 0.0);
}

StepEstimate explicit_step(const Materials& materials, const Matrix3X& position, double dt, bool closely) {
    StepEstimate estimate;
    estimate.substeps = std::max(1, materials.substeps);
    const RowSums rows = row_sums(materials, position);
    for (Index v = 0; v < position.cols(); ++v) {
        if (!materials.is_free(v)) continue;
        const double mass = materials.mass[at(v)];
        for (int axis = 0; axis < 3; ++axis) {
            const double squared = rows.stiffness(axis, v) / mass;
            const double rate = 2.0 * rows.damping(axis, v) / mass;
            estimate.stable_step_undamped = std::min(estimate.stable_step_undamped, longest_step(squared, 0.0));
            const double step = longest_step(squared, rate);
            if (step >= estimate.stable_step) continue;
            estimate.stable_step = step;
            estimate.vertex = v;
            estimate.vertex_mass = mass;
            estimate.damping_decides = rate > squared * step;
        }
    }
    double heaviest = -1.0;
    for (const Spring& spring : materials.springs) {
        if (!materials.is_free(spring.i) && !materials.is_free(spring.j)) continue;
        ++estimate.springs;
        if (spring.i != estimate.vertex && spring.j != estimate.vertex) continue;
        const double h = estimate.stable_step;
        const double weight = h * h * stiffness_block(spring, position).norm() + 2.0 * h * spring.damping;
        if (weight <= heaviest) continue;
        heaviest = weight;
        estimate.edge = {spring.i, spring.j};
        estimate.edge_stiffness = spring.k;
        estimate.edge_damping = spring.damping;
    }
    if (estimate.vertex < 0) return estimate;
    estimate.substeps_stable = static_cast<int>(std::clamp(std::ceil(dt / estimate.stable_step), 1.0, 1e9));
    if (closely || dt / estimate.substeps > estimate.stable_step) {
        estimate.unstable_step = unstable_step(materials, position, estimate.stable_step);
    }
    return estimate;
}

}  // namespace trocar
