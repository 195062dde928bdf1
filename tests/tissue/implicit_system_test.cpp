// A step of `implicit` against the equation that it solves: the matrix is built spring by spring and solved densely.
#include "tissue/implicit_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>
#include <vector>

#include "contact/response_output.hpp"
#include "method/registry.hpp"
#include "support/random_vectors.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

constexpr double h = 1e-3;  // s

/// Random tissue under random forces. Springs, some of them pushing, tie each vertex v to v+1 and v+3; every seventh
/// vertex is pinned.
struct Tangle {
    static constexpr Index vertices = 60;
    std::mt19937 random;
    std::uniform_real_distribution<double> unit{0.0, 1.0};
    test::TissueSample s;
    ResponseOutput output;

    explicit Tangle(unsigned seed) : random(seed), s(sample()), output(test::empty_output(s.topology)) {
        for (Index v = 0; v < vertices; ++v) {
            s.materials.drag[at(v)] = 0.01 * unit(random);
            output.held_force.col(v) = 0.1 * (test::random_vector(unit, random) - Vector3::Constant(0.5));
            if (s.materials.pinned[at(v)] != 0) continue;
            s.frame.velocity.col(v) = 0.2 * (test::random_vector(unit, random) - Vector3::Constant(0.5));
        }
    }
    test::TissueSample sample() {
        std::vector<Vector3> points;
        std::vector<double> mass;
        std::vector<std::uint8_t> pinned;
        for (Index v = 0; v < vertices; ++v) {
            points.emplace_back(0.01 * test::random_vector(unit, random));
            mass.push_back(1e-5 * (0.5 + unit(random)));
            pinned.push_back(v % 7 == 6 ? 1 : 0);
        }
        std::vector<Spring> springs;
        for (Index v = 0; v < vertices; ++v) {
            for (const Index other : {v + 1, v + 3}) {
                if (other >= vertices) continue;
                springs.push_back({.i = v,
                                   .j = other,
                                   .rest = (0.7 + 0.6 * unit(random)) * (points[at(v)] - points[at(other)]).norm(),
                                   .k = 50.0 * (0.5 + unit(random)),
                                   .damping = 0.01 * unit(random)});
            }
        }
        return test::make_tissue(points, mass, pinned, springs);
    }

    /// Two enclosures of four vertices each; one has a pinned vertex.
    void enclose() {
        for (const Index corner : {1, 10}) {
            Enclosure tetrahedron{.triangles = Triangles(3, 4), .bulk_modulus = 1e4};
            tetrahedron.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
            tetrahedron.triangles.array() += corner;
            const double volume = enclosed_volume(tetrahedron.triangles, s.frame.position);
            if (volume < 0.0) tetrahedron.triangles.row(0).swap(tetrahedron.triangles.row(1));
            tetrahedron.volume = 1.1 * std::abs(volume);
            s.materials.enclosures.push_back(tetrahedron);
        }
    }

    /// Contacts that press, stay open, pull, hold in both directions and yield, on up to six vertices each.
    void press() {
        for (Index c = 0; c < 24; ++c) {
            const Vector3 direction = test::random_vector(unit, random) - Vector3::Constant(0.5);
            ContactForceLaw contact = test::plane_contact(2 * c, direction.normalized(), 2e-4 * (unit(random) - 0.5),
                                                          2e3, 0.5 * unit(random));
            contact.vertices = {2 * c, 2 * c + 1, 2 * c + 7};
            contact.weights = {0.5, 0.3, 0.2};
            if (c % 3 == 0) {
                contact.reaction_vertices = {2 * c + 9, 2 * c + 10, 2 * c + 12};
                contact.reaction_weights = {0.6, 0.1, 0.3};
            } else {
                contact.face_velocity = 0.1 * (unit(random) - 0.5);
            }
            if (c % 4 == 1) contact.role = ContactRole::grasp;
            if (c % 5 == 2) contact.adhesive = true;
            if (c % 6 == 3) contact.limit = 0.01;
            output.contacts.push_back(contact);
        }
    }

    /// Velocity of the frame after one step, as solved with the full matrix from given contact forces (N).
    [[nodiscard]] Matrix3X expected(const std::vector<double>& forces) const {
        Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3 * vertices, 3 * vertices);
        Eigen::MatrixXd stiffness = a;
        for (const Spring& spring : s.materials.springs) {
            const Vector3 d = s.frame.position.col(spring.j) - s.frame.position.col(spring.i);
            const double length = d.norm();
            const Matrix3 along = d * d.transpose() / (length * length);
            const double tension = spring.preload + spring.k * (length - spring.rest);
            const Matrix3 k = spring.k * along + std::max(tension, 0.0) / length * (Matrix3::Identity() - along);
            for (const Index v : {spring.i, spring.j}) {
                for (const Index w : {spring.i, spring.j}) {
                    const double sign = v == w ? 1.0 : -1.0;
                    stiffness.block<3, 3>(3 * v, 3 * w) += sign * k;
                    a.block<3, 3>(3 * v, 3 * w) += sign * h * spring.damping * along;
                }
            }
        }
        for (const Enclosure& enclosure : s.materials.enclosures) {
            const Eigen::VectorXd gradient = volume_gradient(enclosure);
            stiffness += enclosure.bulk_modulus / enclosure.volume * gradient * gradient.transpose();
        }
        a += h * h * stiffness;
        Matrix3X force;
        internal_force(s.materials, s.frame.position, s.frame.velocity, force);
        force += output.held_force;
        Eigen::VectorXd right = h * force.reshaped() - h * h * stiffness * s.frame.velocity.reshaped();
        for (std::size_t c = 0; c < forces.size(); ++c) right += h * forces[c] * row_of(output.contacts[c]);
        for (Index v = 0; v < vertices; ++v) {
            if (s.materials.is_free(v)) {
                a.diagonal().segment<3>(3 * v).array() += s.materials.mass[at(v)] + h * s.materials.drag[at(v)];
                continue;
            }
            right.segment<3>(3 * v).setZero();
            a.middleRows<3>(3 * v).setZero();
            a.middleCols<3>(3 * v).setZero();
            a.diagonal().segment<3>(3 * v).setOnes();
        }
        const Eigen::VectorXd change = a.ldlt().solve(right);
        return s.frame.velocity + change.reshaped(3, vertices);
    }
    /// Central differences, which are exact for a cubic up to its third power.
    [[nodiscard]] Eigen::VectorXd volume_gradient(const Enclosure& enclosure) const {
        constexpr double step = 1e-5;  // m
        Eigen::VectorXd gradient(3 * vertices);
        for (Eigen::Index n = 0; n < gradient.size(); ++n) {
            Matrix3X ahead = s.frame.position;
            Matrix3X behind = s.frame.position;
            ahead.data()[n] += step;
            behind.data()[n] -= step;
            gradient[n] = (enclosed_volume(enclosure.triangles, ahead) - enclosed_volume(enclosure.triangles, behind)) /
                          (2.0 * step);
        }
        return gradient;
    }
    /// Row of a contact in the space of all velocities.
    [[nodiscard]] static Eigen::VectorXd row_of(const ContactForceLaw& contact) {
        Eigen::VectorXd row = Eigen::VectorXd::Zero(3 * vertices);
        for (std::size_t i = 0; i < 3; ++i) {
            if (contact.vertices[i] >= 0)
                row.segment<3>(3 * contact.vertices[i]) += contact.weights[i] * contact.normal;
            if (contact.reaction_vertices[i] >= 0)
                row.segment<3>(3 * contact.reaction_vertices[i]) -= contact.reaction_weights[i] * contact.normal;
        }
        return row;
    }
};

/// N, of a contact's law at the end of a step with these velocities.
double force_of_law(const ContactForceLaw& contact, const Matrix3X& velocity) {
    const double rate = Tangle::row_of(contact).dot(velocity.reshaped()) - contact.face_velocity;
    const double start = -contact.gap;
    const double end = start - h * rate;
    if (contact.bilateral()) return std::clamp(contact.k * end - contact.mu * rate, -contact.limit, contact.limit);
    if (contact.adhesive) {
        const double force = start >= 0.0 ? contact.k * end - contact.mu * rate : 0.0;
        return std::clamp(force, -contact.limit, contact.limit);
    }
    const double pressing = contact.k * end + contact.mu * (end - std::max(start, 0.0)) / h;
    return std::clamp(pressing, 0.0, contact.limit);
}

TEST(ImplicitSystem, AStepIsThatOfADenseSolve) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
        for (const bool has_enclosures : {false, true}) {
            for (const bool has_contacts : {false, true}) {
                SCOPED_TRACE(testing::Message()
                             << "seed " << seed << ", enclosures " << has_enclosures << ", contacts " << has_contacts);
                Tangle tangle(seed);
                if (has_enclosures) tangle.enclose();
                if (has_contacts) tangle.press();
                test::Stepped p(tangle.s, make_stepper("implicit", {{"tolerance", "1e-12"}, {"iterations", "5000"}}));
                p.output = tangle.output;
                ASSERT_TRUE(p.advance(h).ok());
                std::vector<double> forces;
                double largest = 0.0;
                int open = 0;
                int limited = 0;
                for (std::size_t c = 0; c < p.output.contacts.size(); ++c) {
                    const ContactForce& force = p.stepper->contact_forces()[c];
                    forces.push_back(force.normal);
                    largest = std::max(largest, std::abs(force.normal));
                    open += force.normal == 0.0 ? 1 : 0;
                    limited += force.at_limit ? 1 : 0;
                }
                for (std::size_t c = 0; c < forces.size(); ++c) {
                    EXPECT_NEAR(forces[c], force_of_law(p.output.contacts[c], p.s.frame.velocity), 1e-6 * largest) << c;
                }
                const Matrix3X expected = tangle.expected(forces);
                EXPECT_LT((p.s.frame.velocity - expected).norm(), 1e-5 * (expected - tangle.s.frame.velocity).norm());
                if (!has_contacts) continue;
                EXPECT_GT(open, 0);
                EXPECT_GT(limited, 0);
                EXPECT_LT(open + limited, 20) << "or few contacts are part of the system";
            }
        }
    }
}

}  // namespace
}  // namespace trocar
