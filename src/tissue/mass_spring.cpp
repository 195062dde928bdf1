#include "tissue/mass_spring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar {
Vector3 spring_force(const Spring& spring, const Matrix3X& position, const Matrix3X& velocity) {
    const Vector3 d = position.col(spring.j) - position.col(spring.i);
    const double length = d.norm();
    if (length == 0.0) return Vector3::Zero();
    const Vector3 u = d / length;
    const double closing = (velocity.col(spring.j) - velocity.col(spring.i)).dot(u);
    return (spring.k * (length - spring.rest) + spring.preload + spring.damping * closing) * u;
}

void internal_force(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity, Matrix3X& force) {
    if (materials.rest_bias.cols() == position.cols()) {
        force = materials.rest_bias;
    } else {
        force.setZero(3, position.cols());
    }
    for (const Spring& spring : materials.springs) {
        const Vector3 f = spring_force(spring, position, velocity);
        force.col(spring.i) += f;
        force.col(spring.j) -= f;
    }
    add_volume_force(materials.enclosures, position, force);
    for (std::size_t v = 0; v < materials.drag.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        if (materials.drag[v] != 0.0) force.col(column) -= materials.drag[v] * velocity.col(column);
    }
}

double spring_energy(const Spring& spring, double length) {
    const double stretch = length - spring.rest;
    return 0.5 * spring.k * stretch * stretch + spring.preload * stretch;
}

double potential_energy(const Materials& materials, const Matrix3X& position) {
    double energy =
        materials.rest_bias.cols() == position.cols() ? -materials.rest_bias.cwiseProduct(position).sum() : 0.0;
    for (const Spring& spring : materials.springs) {
        energy += spring_energy(spring, (position.col(spring.j) - position.col(spring.i)).norm());
    }
    return energy + volume_energy(materials.enclosures, position);
}

double dissipated_power(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity,
                        std::span<const std::uint8_t> moves) {
    double power = 0.0;
    for (const Spring& spring : materials.springs) {
        const Vector3 d = position.col(spring.j) - position.col(spring.i);
        const double length = d.norm();
        if (spring.damping == 0.0 || length == 0.0) continue;
        const Vector3 u = d / length;
        const double force = spring.damping * (velocity.col(spring.j) - velocity.col(spring.i)).dot(u);
        if (moves[at(spring.i)] != 0) power -= force * velocity.col(spring.i).dot(u);
        if (moves[at(spring.j)] != 0) power += force * velocity.col(spring.j).dot(u);
    }
    for (std::size_t v = 0; v < materials.drag.size(); ++v) {
        if (moves[v] != 0) power += materials.drag[v] * velocity.col(static_cast<Eigen::Index>(v)).squaredNorm();
    }
    return power;
}

MassSpring::MassSpring(const Topology& topology, const Materials& materials)
    : tissue_(topology, materials), solver_(topology.vertex_count, tissue_.state().size()) {
    position_before_.reserve(tissue_.state().size());
    tissue_.spring_arrays().stencil = spring_stencil(tissue_.spring_arrays());
}

Outcome MassSpring::advance(const ResponseOutput& output, double dt, Frame& frame, std::vector<Wrench>& reaction) {
    return advance(output, dt, frame, frame, reaction);
}

Outcome MassSpring::advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                            std::vector<Wrench>& reaction) {
    tissue_.take_over(output, from);
    Outcome outcome = integrate(output, dt, from);
    tissue_.release(output);
    if (!outcome.ok()) return outcome;
    tissue_.give_back(output, from, to);
    solver_.contacts().react(reaction);
    return outcome;
}

Outcome MassSpring::integrate(const ResponseOutput& output, double dt, const Frame& frame) {
    TissueState& state = tissue_.state();
    solver_.collect(output, frame, state);
    TickContacts& contacts = solver_.contacts();
    const bool implicit = output.contact_timing == ContactTiming::implicit;
    const int substeps = std::max(1, tissue_.materials().substeps);
    const double h = dt / substeps;
    const std::span<const Index> touched = contacts.touched();
    position_before_.resize(touched.size());
    double bound = 0.0;  // m, bound on the displacement of any coordinate in this tick
    for (int substep = 0; substep < substeps; ++substep) {
        contacts.begin_substep(state);
        for (std::size_t t = 0; t < touched.size(); ++t) {
            position_before_[t] = state.position.col(touched[t]).head<3>();
        }
        tissue_.add_volume_force();
        SubStepCheck check = tissue_.kernels().sub_step(h, tissue_.spring_arrays(), state);
        if (!touched.empty()) {
            // The sub-step applies spring forces only. Contacts then correct its velocities, and positions follow from
            // those.
            if (implicit) {
                solver_.solve(h, state);
            } else {
                solver_.push_held(h, state);
            }
            solver_.rub(h, state);
            contacts.solve_impulses(h, substeps, state);
            contacts.finish_substep(h, substeps, state);
            for (std::size_t t = 0; t < touched.size(); ++t) {
                const Vector3 path = h * state.velocity.col(touched[t]).head<3>();
                state.position.col(touched[t]).head<3>() = position_before_[t] + path;
                check.finite = check.finite && path.allFinite();
                check.furthest = std::max(check.furthest, path.cwiseAbs().maxCoeff());
            }
            check.furthest += contacts.shift(tissue_);
        }
        bound += check.furthest;
        // The check runs in every sub-step, to report instability before the numbers overflow.
        Outcome outcome = tissue_.check(check.finite, bound, output, frame);
        if (!outcome.ok()) return outcome;
    }
    tissue_.limit_strain();
    // The bound of the sub-steps covers springs only, so contacts or the strain limiter require the exact maximum.
    largest_move_ = tissue_.limited_edges() > 0 || !touched.empty()
                        ? tissue_.longest_path(frame.position)
                        : std::sqrt(3.0) * bound + tissue_.placed_move(output, frame);
    if (tissue_.limited_edges() > 0 && blows_up(dt, output, frame)) {
        return {OutcomeKind::unstable,
                fmt::format("sub-steps of {:.3g} ms are beyond the stability limit; only the strain limit holds the "
                            "springs together ({} sub-steps a tick are stable)",
                            h * 1e3, stable_substeps(tissue_.materials(), tissue_.start_of(output, frame), dt))};
    }
    return {};
}

/// True if the strain limiter hides an unstable scheme. Only every 64th tick with limited edges is tested, at the
/// positions at the start of the tick.
bool MassSpring::blows_up(double dt, const ResponseOutput& output, const Frame& frame) {
    constexpr std::int64_t seldom = 64;
    if (limited_ticks_++ % seldom != 0) return false;
    const int substeps = std::max(1, tissue_.materials().substeps);
    const Matrix3X start = tissue_.start_of(output, frame);
    if (substeps >= stable_substeps(tissue_.materials(), start, dt)) return false;
    return surely_unstable(tissue_.materials(), start, dt / substeps);
}

}  // namespace trocar
