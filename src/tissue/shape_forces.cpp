#include "tissue/shape_forces.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/tissue_materials.hpp"

namespace trocar {
namespace {

void add_spring_force(const Spring& spring, const Points& position, PointsOut& force) {
    const Vector3 d = position.col(spring.j) - position.col(spring.i);
    const double length = d.norm();
    const double tension = stiffening_tension(spring, length);
    if (tension == 0.0) return;
    const Vector3 pull = tension / length * d;
    force.col(spring.i) += pull;
    force.col(spring.j) -= pull;
}

void add_hinge_force(const Hinge& hinge, const Points& position, PointsOut& force) {
    const Dihedral now = dihedral(corners_of(hinge, position));
    if (!now.has_angle) return;
    const double moment = -hinge.stiffness * bend_of(hinge, now);
    for (std::size_t corner = 0; corner < 4; ++corner) force.col(hinge.vertex[corner]) += moment * now.gradient[corner];
}

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

/// Of one hinge: the change of minus its forces for a displacement of its corners.
std::array<Vector3, 4> hinge_stiffness(const Hinge& hinge, const HingeCorners& corners, const Dihedral& now,
                                       const std::array<Vector3, 4>& displacement) {
    double turn = 0.0;
    for (std::size_t corner = 0; corner < 4; ++corner) turn += now.gradient[corner].dot(displacement[corner]);
    const double bend = bend_of(hinge, now);
    std::array<Vector3, 4> result = gradient_change(corners, displacement);
    for (std::size_t corner = 0; corner < 4; ++corner) {
        result[corner] = hinge.stiffness * (turn * now.gradient[corner] + bend * result[corner]);
    }
    return result;
}

void add_hinge_rows(const Hinge& hinge, const Points& position, std::span<const double> inverse_mass, PointsOut& rows) {
    const HingeCorners corners = corners_of(hinge, position);
    const Dihedral now = dihedral(corners);
    if (!now.has_angle) return;
    std::array<Vector3, 4> unit;
    for (std::size_t moved = 0; moved < 4; ++moved) {
        if (inverse_mass[at(hinge.vertex[moved])] == 0.0) continue;
        for (int axis = 0; axis < 3; ++axis) {
            unit.fill(Vector3::Zero());
            unit[moved][axis] = 1.0;
            const std::array<Vector3, 4> column = hinge_stiffness(hinge, corners, now, unit);
            for (std::size_t corner = 0; corner < 4; ++corner) {
                rows.col(hinge.vertex[corner]) += column[corner].cwiseAbs();
            }
        }
    }
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
    // A third of the area normal on each corner; it changes by half the edge opposite × what a corner moves.
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

double bend_of(const Hinge& hinge, const Dihedral& dihedral) {
    double bend = dihedral.angle - hinge.rest;
    if (bend > std::numbers::pi) bend -= 2.0 * std::numbers::pi;
    if (bend < -std::numbers::pi) bend += 2.0 * std::numbers::pi;
    return bend;
}

void add_shape_force(const ShapeElements& elements, const Points& position, PointsOut force) {
    for (const Spring& spring : elements.stiffening) add_spring_force(spring, position, force);
    for (const Hinge& hinge : elements.hinges) add_hinge_force(hinge, position, force);
    for (const Enclosure& enclosure : elements.enclosures) {
        add_volume_gradient(enclosure.triangles, position, pressure(enclosure, position), force);
    }
}

double shape_energy(const ShapeElements& elements, const Points& position) {
    double energy = 0.0;
    for (const Spring& spring : elements.stiffening) {
        energy += stiffening_energy(spring, (position.col(spring.j) - position.col(spring.i)).norm());
    }
    for (const Hinge& hinge : elements.hinges) {
        const Dihedral now = dihedral(corners_of(hinge, position));
        if (!now.has_angle) continue;
        const double bend = bend_of(hinge, now);
        energy += 0.5 * hinge.stiffness * bend * bend;
    }
    for (const Enclosure& enclosure : elements.enclosures) {
        const double change = enclosed_volume(enclosure.triangles, position) - enclosure.volume;
        energy += 0.5 * enclosure.bulk_modulus * change * change / enclosure.volume;
    }
    return energy;
}

double pressure(const Enclosure& enclosure, const Points& position) {
    return -enclosure.bulk_modulus * (enclosed_volume(enclosure.triangles, position) / enclosure.volume - 1.0);
}

void add_shape_stiffness(const ShapeElements& elements, const Points& position, const Points& displacement,
                         PointsOut force) {
    for (const Hinge& hinge : elements.hinges) {
        const HingeCorners corners = corners_of(hinge, position);
        const Dihedral now = dihedral(corners);
        if (!now.has_angle) continue;
        const std::array<Vector3, 4> change = hinge_stiffness(hinge, corners, now, corners_of(hinge, displacement));
        for (std::size_t corner = 0; corner < 4; ++corner) force.col(hinge.vertex[corner]) += change[corner];
    }
    for (const Enclosure& enclosure : elements.enclosures) {
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

void add_shape_row_sums(const ShapeElements& elements, const Points& position, std::span<const double> inverse_mass,
                        PointsOut rows) {
    for (const Hinge& hinge : elements.hinges) add_hinge_rows(hinge, position, inverse_mass, rows);
    for (const Enclosure& enclosure : elements.enclosures) {
        add_enclosure_rows(enclosure, position, inverse_mass, rows);
    }
}

ShapeForces::ShapeForces(const Materials& materials, std::span<const Index> place) {
    const auto local = [&](Index vertex) { return place.empty() ? vertex : place[at(vertex)]; };
    for (Spring spring : materials.springs) {
        if (!(spring.stiffening > 0.0)) continue;
        spring.i = local(spring.i);
        spring.j = local(spring.j);
        if (spring.i >= 0 && spring.j >= 0) springs_.push_back(spring);
    }
    for (Hinge hinge : materials.hinges) {
        for (Index& v : hinge.vertex) v = local(v);
        if (std::all_of(hinge.vertex.begin(), hinge.vertex.end(), [](Index v) { return v >= 0; })) {
            hinges_.push_back(hinge);
        }
    }
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
        linear_enclosures_.push_back(std::move(linear));
        enclosures_.push_back(std::move(enclosure));
    }
    linear_springs_.resize(springs_.size());
    linear_hinges_.resize(hinges_.size());
    hinge_arrays_ = hinge_arrays(hinges_);
    // Here and not in a tick, where making their list would ask for memory.
    if (!hinges_.empty()) hinge_kernels_ = &hinge_kernels().front();
    if (!enclosures_.empty()) volume_gradient_.setZero(3, columns);
}

void ShapeForces::add_force(const Matrix4X& position, Matrix4X& force) const {
    const ShapeElements others{.stiffening = springs_, .hinges = {}, .enclosures = enclosures_};
    add_shape_force(others, position.topRows<3>(), force.topRows<3>());
    if (hinge_kernels_ != nullptr) hinge_kernels_->add_forces(hinge_arrays_, position, force);
}

void ShapeForces::linearise(const Points& position) {
    for (std::size_t s = 0; s < springs_.size(); ++s) {
        const Spring& spring = springs_[s];
        const Vector3 d = position.col(spring.j) - position.col(spring.i);
        const double length = d.norm();
        const double tension = stiffening_tension(spring, length);
        linear_springs_[s] = {.i = spring.i, .j = spring.j, .block = Matrix3::Zero()};
        if (tension == 0.0) continue;
        const Matrix3 along = d * d.transpose() / (length * length);
        linear_springs_[s].block =
            3.0 * tension / (length - spring.rest) * along + tension / length * (Matrix3::Identity() - along);
    }
    for (std::size_t h = 0; h < hinges_.size(); ++h) {
        linear_hinges_[h] = {.vertex = hinges_[h].vertex,
                             .slope = dihedral(corners_of(hinges_[h], position)).gradient,
                             .stiffness = hinges_[h].stiffness};
    }
    for (std::size_t e = 0; e < enclosures_.size(); ++e) {
        LinearEnclosure& linear = linear_enclosures_[e];
        for (const Index v : linear.vertex) volume_gradient_.col(v).setZero();
        add_volume_gradient(enclosures_[e].triangles, position, 1.0, volume_gradient_);
        for (std::size_t i = 0; i < linear.vertex.size(); ++i) {
            linear.gradient.col(static_cast<Eigen::Index>(i)) = volume_gradient_.col(linear.vertex[i]);
        }
        linear.stiffness = enclosures_[e].bulk_modulus / enclosures_[e].volume;
    }
}

void ShapeForces::add_product(const Points& displacement, PointsOut force) const {
    for (const LinearSpring& spring : linear_springs_) {
        const Vector3 f = spring.block * (displacement.col(spring.i) - displacement.col(spring.j));
        force.col(spring.i) += f;
        force.col(spring.j) -= f;
    }
    for (const LinearHinge& hinge : linear_hinges_) {
        double turn = 0.0;
        for (std::size_t corner = 0; corner < 4; ++corner) {
            turn += hinge.slope[corner].dot(displacement.col(hinge.vertex[corner]));
        }
        turn *= hinge.stiffness;
        for (std::size_t corner = 0; corner < 4; ++corner)
            force.col(hinge.vertex[corner]) += turn * hinge.slope[corner];
    }
    for (const LinearEnclosure& enclosure : linear_enclosures_) {
        double change = 0.0;
        for (std::size_t i = 0; i < enclosure.vertex.size(); ++i) {
            change += enclosure.gradient.col(static_cast<Eigen::Index>(i)).dot(displacement.col(enclosure.vertex[i]));
        }
        change *= enclosure.stiffness;
        for (std::size_t i = 0; i < enclosure.vertex.size(); ++i) {
            force.col(enclosure.vertex[i]) += change * enclosure.gradient.col(static_cast<Eigen::Index>(i));
        }
    }
}

}  // namespace trocar
