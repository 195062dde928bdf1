// Tissue with an irregular spring network, and its implicit system as a dense matrix.
#pragma once

#include <random>
#include <vector>

#include "support/random_vectors.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/spring_system.hpp"

namespace trocar::test {

/// Random tissue whose springs connect each vertex v with v+1 and v+3; every seventh vertex is pinned.
inline TissueSample tangle(unsigned seed) {
    constexpr Index vertices = 60;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Vector3> points;
    std::vector<double> mass;
    std::vector<std::uint8_t> pinned;
    for (Index v = 0; v < vertices; ++v) {
        points.emplace_back(0.01 * random_vector(unit, random));
        mass.push_back(1e-5 * (0.5 + unit(random)));
        pinned.push_back(v % 7 == 6 ? 1 : 0);
    }
    std::vector<Spring> springs;
    for (Index v = 0; v < vertices; ++v) {
        for (const Index step : {1, 3}) {
            const Index other = v + step;
            if (other >= vertices) continue;
            Spring spring;
            spring.i = v;
            spring.j = other;
            spring.rest = 0.9 * (points[at(v)] - points[at(other)]).norm();
            spring.k = 50.0 * (0.5 + unit(random));
            spring.damping = 0.01 * unit(random);
            springs.push_back(spring);
        }
    }
    return make_tissue(points, mass, pinned, springs);
}

/// Matrix A of SpringSystem, dense, over all vertices of the state.
inline Eigen::MatrixXd dense(const SpringArrays& springs, const SpringSystem& system) {
    const auto vertices = static_cast<Eigen::Index>(system.inertia.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3 * vertices, 3 * vertices);
    const auto add = [&a](Index v, Index w, const Matrix3& block) { a.block<3, 3>(3 * v, 3 * w) += block; };
    for (std::size_t s = 0; s < springs.size(); ++s) {
        const Vector3 u(system.x[s], system.y[s], system.z[s]);
        const Matrix3 block = system.alpha[s] * u * u.transpose() + system.beta[s] * Matrix3::Identity();
        add(springs.i[s], springs.i[s], block);
        add(springs.j[s], springs.j[s], block);
        add(springs.i[s], springs.j[s], -block);
        add(springs.j[s], springs.i[s], -block);
    }
    for (Eigen::Index v = 0; v < vertices; ++v) {
        const double inertia = system.inertia[static_cast<std::size_t>(v)];
        if (inertia > 0.0) {
            a.diagonal().segment<3>(3 * v).array() += inertia;
            continue;
        }
        a.middleRows<3>(3 * v).setZero();
        a.middleCols<3>(3 * v).setZero();
        a.diagonal().segment<3>(3 * v).setOnes();
    }
    return a;
}

}  // namespace trocar::test
