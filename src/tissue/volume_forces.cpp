#include "tissue/volume_forces.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

/// Change of a triangle's area normal, m², to first order.
Vector3 area_normal_change(const Enclosure& enclosure, Eigen::Index t, const Points& position,
                           const Points& displacement) {
    const auto corner = enclosure.triangles.col(t);
    const Vector3 ab = position.col(corner[1]) - position.col(corner[0]);
    const Vector3 ac = position.col(corner[2]) - position.col(corner[0]);
    const Vector3 d_ab = displacement.col(corner[1]) - displacement.col(corner[0]);
    const Vector3 d_ac = displacement.col(corner[2]) - displacement.col(corner[0]);
    return 0.5 * (d_ab.cross(ac) + ab.cross(d_ac));
}

void add_enclosure_rows(const Enclosure& enclosure, const Points& position, std::span<const double> inverse_mass,
                        PointsOut& rows) {
    Matrix3X gradient = Matrix3X::Zero(3, position.cols());
    add_volume_gradient(enclosure.triangles, position, 1.0, gradient);
    double square = 0.0;
    for (Eigen::Index v = 0; v < position.cols(); ++v) {
        square += gradient.col(v).squaredNorm() * inverse_mass[static_cast<std::size_t>(v)];
    }
    const double lambda = enclosure.bulk_modulus / enclosure.volume * square;
    for (Eigen::Index v = 0; v < position.cols(); ++v) {
        const double inverse = inverse_mass[static_cast<std::size_t>(v)];
        if (inverse > 0.0 && gradient.col(v).squaredNorm() > 0.0) rows.col(v).array() += lambda / inverse;
    }
    // Each corner gets a third of the area normal, which changes by half the opposite edge × the corner's displacement.
    const double factor = std::abs(pressure(enclosure, position)) / 6.0;
    for (Eigen::Index t = 0; t < enclosure.triangles.cols(); ++t) {
        const auto corner = enclosure.triangles.col(t);
        Vector3 row = Vector3::Zero();
        for (int moved = 0; moved < 3; ++moved) {
            if (inverse_mass[at(corner[moved])] == 0.0) continue;
            const Vector3 edge =
                (position.col(corner[(moved + 2) % 3]) - position.col(corner[(moved + 1) % 3])).cwiseAbs();
            row += Vector3::Constant(edge.sum()) - edge;
        }
        for (int of = 0; of < 3; ++of) rows.col(corner[of]) += factor * row;
    }
}

}  // namespace

void add_volume_force(std::span<const Enclosure> enclosures, const Points& position, PointsOut force) {
    for (const Enclosure& enclosure : enclosures) {
        add_volume_gradient(enclosure.triangles, position, pressure(enclosure, position), force);
    }
}

double volume_energy(std::span<const Enclosure> enclosures, const Points& position) {
    double energy = 0.0;
    for (const Enclosure& enclosure : enclosures) {
        const double change = enclosed_volume(enclosure.triangles, position) - enclosure.volume;
        energy += 0.5 * enclosure.bulk_modulus * change * change / enclosure.volume;
    }
    return energy;
}

double pressure(const Enclosure& enclosure, const Points& position) {
    return -enclosure.bulk_modulus * (enclosed_volume(enclosure.triangles, position) / enclosure.volume - 1.0);
}

void add_volume_stiffness(std::span<const Enclosure> enclosures, const Points& position, const Points& displacement,
                          PointsOut force) {
    for (const Enclosure& enclosure : enclosures) {
        const double over = pressure(enclosure, position);
        double volume_change = 0.0;
        for (Eigen::Index t = 0; t < enclosure.triangles.cols(); ++t) {
            const auto corner = enclosure.triangles.col(t);
            const Vector3 a = position.col(corner[0]);
            const Vector3 area = 0.5 * (position.col(corner[1]) - a).cross(position.col(corner[2]) - a);
            const Vector3 share = over / 3.0 * area_normal_change(enclosure, t, position, displacement);
            for (int of = 0; of < 3; ++of) {
                volume_change += area.dot(displacement.col(corner[of])) / 3.0;
                force.col(corner[of]) -= share;
            }
        }
        const double stiffness = enclosure.bulk_modulus / enclosure.volume;
        add_volume_gradient(enclosure.triangles, position, stiffness * volume_change, force);
    }
}

void add_volume_row_sums(std::span<const Enclosure> enclosures, const Points& position,
                         std::span<const double> inverse_mass, PointsOut rows) {
    for (const Enclosure& enclosure : enclosures) add_enclosure_rows(enclosure, position, inverse_mass, rows);
}

VolumeForces::VolumeForces(const Materials& materials, std::span<const Index> place) {
    const auto local = [&](Index vertex) { return place.empty() ? vertex : place[at(vertex)]; };
    Index columns = 0;
    for (Enclosure enclosure : materials.enclosures) {
        enclosure.triangles = enclosure.triangles.unaryExpr(local).eval();
        if (enclosure.triangles.cols() == 0 || enclosure.triangles.minCoeff() < 0) continue;
        LinearEnclosure linear;
        linear.vertex.assign(enclosure.triangles.data(), enclosure.triangles.data() + enclosure.triangles.size());
        std::sort(linear.vertex.begin(), linear.vertex.end());
        linear.vertex.erase(std::unique(linear.vertex.begin(), linear.vertex.end()), linear.vertex.end());
        linear.gradient = Matrix3X::Zero(3, static_cast<Eigen::Index>(linear.vertex.size()));
        columns = std::max(columns, linear.vertex.back() + 1);
        linear_.push_back(std::move(linear));
        enclosures_.push_back(std::move(enclosure));
    }
    if (!enclosures_.empty()) gradient_.setZero(3, columns);
}

void VolumeForces::linearise(const Points& position) {
    for (std::size_t e = 0; e < enclosures_.size(); ++e) {
        LinearEnclosure& linear = linear_[e];
        for (const Index v : linear.vertex) gradient_.col(v).setZero();
        add_volume_gradient(enclosures_[e].triangles, position, 1.0, gradient_);
        for (std::size_t i = 0; i < linear.vertex.size(); ++i) {
            linear.gradient.col(static_cast<Eigen::Index>(i)) = gradient_.col(linear.vertex[i]);
        }
        linear.stiffness = enclosures_[e].bulk_modulus / enclosures_[e].volume;
    }
}

}  // namespace trocar
