// Small tissue systems with known results, for tests of integrator and responses.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "contact/response_output.hpp"
#include "method/registry.hpp"
#include "scene/world.hpp"

namespace trocar::test {

/// One tissue body without triangles, with a frame at rest.
struct TissueSample {
    Topology topology;
    Materials materials;
    Frame frame;
};

inline TissueSample make_tissue(const std::vector<Vector3>& points, const std::vector<double>& mass,
                                const std::vector<std::uint8_t>& pinned, const std::vector<Spring>& springs) {
    TissueSample sample;
    const auto n = static_cast<Index>(points.size());
    sample.topology = make_topology({Body{.name = "tissue", .kind = BodyKind::tissue, .vertex_count = n}});
    sample.materials.springs = springs;
    sample.materials.mass = mass;
    sample.materials.pinned = pinned;
    sample.materials.rest_bias = Matrix3X::Zero(3, n);
    sample.materials.drag.assign(points.size(), 0.0);
    sample.materials.mean_stiffness.assign(points.size(), 0.0);
    sample.materials.area.assign(points.size(), 0.0);
    sample.materials.substeps = 1;
    sample.materials.strain_limit = 1e9;
    sample.frame.position.resize(3, n);
    for (Index i = 0; i < n; ++i) sample.frame.position.col(i) = points[static_cast<std::size_t>(i)];
    sample.frame.previous = sample.frame.position;
    sample.frame.velocity = Matrix3X::Zero(3, n);
    return sample;
}

/// One vertex at the origin without springs, that nothing holds; four sub-steps a tick.
inline TissueSample free_vertex(double mass = 1e-3) {
    TissueSample sample = make_tissue({Vector3::Zero()}, {mass}, {0}, {});
    sample.materials.substeps = 4;
    return sample;
}

/// Vertices in a row along x that springs like `one` tie to their neighbours; both ends are pinned.
inline TissueSample make_chain(Index vertices, double mass, const Spring& one) {
    std::vector<Vector3> points;
    std::vector<Spring> springs;
    for (Index v = 0; v < vertices; ++v) {
        points.emplace_back(one.rest * v, 0.0, 0.0);
        if (v == 0) continue;
        springs.push_back(one);
        springs.back().i = v - 1;
        springs.back().j = v;
    }
    std::vector<std::uint8_t> pinned(points.size(), 0);
    pinned.front() = pinned.back() = 1;
    return make_tissue(points, std::vector<double>(points.size(), mass), pinned, springs);
}

/// Equilateral lattice inside a circle, pinned rim, springs of stiffness k with preload p k L; vertex 0 is the centre.
inline TissueSample make_disc(double radius, double edge, double k, double preload, double mass) {
    std::vector<Vector3> points;
    points.emplace_back(0.0, 0.0, 0.0);
    const int rings = 2 * static_cast<int>(radius / edge) + 4;
    for (int i = -rings; i <= rings; ++i) {
        for (int j = -rings; j <= rings; ++j) {
            const Vector3 p(edge * (i + 0.5 * j), edge * std::sqrt(0.75) * j, 0.0);
            if ((i != 0 || j != 0) && p.norm() < radius + 0.5 * edge) points.push_back(p);
        }
    }
    std::vector<Spring> springs;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            if ((points[i] - points[j]).norm() > 1.1 * edge) continue;
            springs.push_back({.i = static_cast<Index>(i),
                               .j = static_cast<Index>(j),
                               .rest = edge,
                               .k = k,
                               .preload = preload * k * edge});
        }
    }
    // Free vertices have all six neighbours; the pinned ring straddles the radius.
    std::vector<std::uint8_t> pinned(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i) pinned[i] = points[i].norm() > radius - 0.5 * edge ? 1 : 0;
    return make_tissue(points, std::vector<double>(points.size(), mass), pinned, springs);
}

/// Empty ResponseOutput of the right size.
inline ResponseOutput empty_output(const Topology& topology) {
    ResponseOutput output;
    output.resize(topology.vertex_count, topology.body_count());
    return output;
}

/// A stepper, `semi_implicit` where none is given, on a sample of its own, with an output that the test fills.
struct Stepped {
    TissueSample s;
    std::unique_ptr<Stepper> stepper;
    ResponseOutput output = empty_output(s.topology);
    std::vector<Wrench> reaction{1};

    explicit Stepped(TissueSample sample, std::unique_ptr<Stepper> by = make_stepper("semi_implicit"))
        : s(std::move(sample)), stepper(std::move(by)) {
        stepper->prepare(s.topology, s.materials);
    }
    Stepped(const Stepped&) = delete;
    Stepped& operator=(const Stepped&) = delete;
    Stepped(Stepped&&) = delete;
    Stepped& operator=(Stepped&&) = delete;
    ~Stepped() = default;

    /// One tick of dt (s).
    [[nodiscard]] Outcome advance(double dt = 1e-3) {
        reaction.assign(1, {});
        return stepper->advance(output, dt, s.frame, s.frame, reaction);
    }
};

/// One contact of a vertex with a plane.
inline ContactForceLaw plane_contact(Index vertex, const Vector3& normal, double gap, double k, double mu) {
    ContactForceLaw contact;
    contact.vertices = {vertex, -1, -1};
    contact.weights = {1.0, 0.0, 0.0};
    contact.normal = normal;
    contact.gap = gap;
    contact.k = k;
    contact.mu = mu;
    return contact;
}

/// Runs 400 ticks of 1 ms. 0.5 N press the vertex of a sample on the plane z = 0, and `along` N pull it along x. The
/// contact has 10⁴ N/m, friction 0.4 and a tangential spring of 2000 N/m. `times` scales forces and springs.
inline void press_and_pull(Stepped& p, double along, double times = 1.0) {
    for (int tick = 0; tick < 400; ++tick) {
        p.output.clear();
        p.output.held_force.col(0) = times * Vector3(along, 0.0, -0.5);
        ContactForceLaw contact =
            plane_contact(0, Vector3::UnitZ(), p.s.frame.position(2, 0), 1e4 * times, 5.0 * times);
        contact.friction = 0.4;
        contact.tangent_k = 2000.0 * times;
        contact.slip_key = 0;
        p.output.contacts.push_back(contact);
        ASSERT_TRUE(p.advance().ok());
    }
}

/// Advances one tick that must fail: checks that frame and reaction are unchanged and that the outcome has a message.
inline OutcomeKind refused_tick(Stepper& stepper, const TissueSample& sample, const ResponseOutput& output,
                                const Frame& from) {
    Frame to = sample.frame;
    std::vector<Wrench> reaction(1);
    const Outcome outcome = stepper.advance(output, 1e-3, from, to, reaction);
    EXPECT_EQ(to.hash(), sample.frame.hash());
    EXPECT_EQ(reaction[0].force, Vector3(Vector3::Zero()));
    EXPECT_NE(outcome.message, "");
    return outcome.kind;
}

}  // namespace trocar::test
