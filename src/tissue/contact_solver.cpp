#include "tissue/contact_solver.hpp"

#include <algorithm>
#include <cmath>

#include "tissue/active_set.hpp"

namespace trocar {

ContactSolver::ContactSolver(Index vertex_count, std::size_t moving) : contacts_(vertex_count, moving) {
    mass_.reserve(moving);
    block_inverse_.reserve(moving);
    const auto columns = static_cast<Eigen::Index>(moving);
    for (Matrix3X* buffer : {&right_side_, &solution_, &residual_, &direction_, &image_, &preconditioned_}) {
        buffer->setZero(3, columns);
    }
}

void ContactSolver::collect(const ResponseOutput& output, const Frame& frame, const TissueState& state) {
    contacts_.collect(output, frame, state);
    crowded_ = false;
    passes_ = 0;
    mass_.clear();
    for (const Index local : touched()) mass_.push_back(1.0 / state.inverse_mass[at(local)]);
    block_inverse_.resize(mass_.size());
}

void ContactSolver::push(const TickContact& contact, double impulse, TissueState& state) const {
    for (int i = 0; i < contact.count; ++i) {
        const Index v = contact.vertex[at(i)];
        velocity_of(state, v) += contact.weight[at(i)] * impulse * state.inverse_mass[at(v)] * contact.normal;
    }
}

void ContactSolver::push_held(double h, TissueState& state) {
    for (TickContact& contact : contacts_.all()) {
        contact.force = contact.held;
        push(contact, h * contact.force, state);
    }
}

/// Right side and inverted diagonal blocks of solve_linear.
void ContactSolver::assemble(double h, const TissueState& state) {
    const auto count = static_cast<Eigen::Index>(mass_.size());
    for (Eigen::Index l = 0; l < count; ++l) {
        const auto spot = static_cast<std::size_t>(l);
        block_inverse_[spot] = mass_[spot] * Matrix3::Identity();
        right_side_.col(l) = mass_[spot] * velocity_of(state, touched()[spot]);
    }
    for (const TickContact& contact : contacts_.all()) {
        if (!contact.on) continue;
        if (contact.capped) {
            for (int i = 0; i < contact.count; ++i) {
                right_side_.col(contacts_.spot(contact.vertex[at(i)])) +=
                    h * contact.force * contact.weight[at(i)] * contact.normal;
            }
            continue;
        }
        const StepLaw law = contact.law(h);
        const double pressure = law.force(contact.fixed_rate) + contact.held;
        for (int i = 0; i < contact.count; ++i) {
            const Index l = contacts_.spot(contact.vertex[at(i)]);
            const double w = contact.weight[at(i)];
            right_side_.col(l) += h * pressure * w * contact.normal;
            block_inverse_[at(l)] += h * law.slope * w * w * contact.normal * contact.normal.transpose();
        }
    }
    for (Matrix3& block : block_inverse_) block = block.inverse().eval();
}

/// Product of the matrix of solve_linear with velocities of the touched vertices.
void ContactSolver::apply(double h, const Matrix3X& velocity, Matrix3X& result) {
    ++passes_;
    for (std::size_t l = 0; l < mass_.size(); ++l) {
        const auto column = static_cast<Eigen::Index>(l);
        result.col(column) = mass_[l] * velocity.col(column);
    }
    for (const TickContact& contact : contacts_.all()) {
        if (!contact.on || contact.capped) continue;
        double sum = 0.0;
        for (int i = 0; i < contact.count; ++i) {
            sum += contact.weight[at(i)] * velocity.col(contacts_.spot(contact.vertex[at(i)])).dot(contact.normal);
        }
        sum *= h * contact.law(h).slope;
        for (int i = 0; i < contact.count; ++i) {
            result.col(contacts_.spot(contact.vertex[at(i)])) += contact.weight[at(i)] * sum * contact.normal;
        }
    }
}

void ContactSolver::precondition() {
    for (std::size_t l = 0; l < mass_.size(); ++l) {
        const auto column = static_cast<Eigen::Index>(l);
        preconditioned_.col(column) = block_inverse_[l] * residual_.col(column);
    }
}

/// Backward Euler of all active contacts: (M + h Σ c Jᵀ J) v' = M v + h Σ F(r) Jᵀ. c is the slope of the law F and r
/// the fixed part of the rate. A contact at its limit is a constant force in the right side. Conjugate gradients are
/// preconditioned by the exact 3×3 blocks of the vertices. Contacts on one vertex each are thus solved exactly before
/// the first iteration. Returns false if the iterations end before convergence.
bool ContactSolver::solve_linear(double h, const TissueState& state) {
    assemble(h, state);
    const auto count = static_cast<Eigen::Index>(mass_.size());
    const auto dot = [count](const Matrix3X& a, const Matrix3X& b) {
        double sum = 0.0;
        for (Eigen::Index l = 0; l < count; ++l) sum += a.col(l).dot(b.col(l));
        return sum;
    };
    for (Eigen::Index l = 0; l < count; ++l) {
        solution_.col(l) = block_inverse_[static_cast<std::size_t>(l)] * right_side_.col(l);
    }
    apply(h, solution_, image_);
    for (Eigen::Index l = 0; l < count; ++l) residual_.col(l) = right_side_.col(l) - image_.col(l);
    precondition();
    for (Eigen::Index l = 0; l < count; ++l) direction_.col(l) = preconditioned_.col(l);
    constexpr int most_iterations = 60;
    constexpr double tolerance = 1e-13;
    const double small = tolerance * tolerance * dot(right_side_, right_side_);
    double rho = dot(residual_, preconditioned_);
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        if (dot(residual_, residual_) <= small) break;
        apply(h, direction_, image_);
        const double curvature = dot(direction_, image_);
        if (!(curvature > 0.0)) break;
        const double step = rho / curvature;
        for (Eigen::Index l = 0; l < count; ++l) {
            solution_.col(l) += step * direction_.col(l);
            residual_.col(l) -= step * image_.col(l);
        }
        precondition();
        const double next = dot(residual_, preconditioned_);
        const double ratio = next / rho;
        rho = next;
        for (Eigen::Index l = 0; l < count; ++l) {
            direction_.col(l) = preconditioned_.col(l) + ratio * direction_.col(l);
        }
    }
    constexpr double exact = 1e-6;
    return dot(residual_, residual_) <= exact * exact * dot(right_side_, right_side_);
}

void ContactSolver::solve(double h, TissueState& state) {
    for (TickContact& contact : contacts_.all()) {
        contact.on = contact.bilateral || contact.depth >= 0.0;
        contact.capped = false;
        // Explicit (negative) damping acts at the velocity at the start of the sub-step.
        contact.held = contact.on ? -contact.explicit_damping * TickContacts::rate(contact, state) : 0.0;
    }
    if (!crowded_ && find_active(h, state)) {
        for (std::size_t l = 0; l < mass_.size(); ++l) {
            velocity_of(state, touched()[l]) = solution_.col(static_cast<Eigen::Index>(l));
        }
        return;
    }
    crowded_ = true;
    sweep(h, state);
}

/// See trocar::find_active. Also fails after a bounded number of matrix products.
bool ContactSolver::find_active(double h, const TissueState& state) {
    constexpr int most_products = 1500;
    const std::int64_t start = passes_;
    const auto solved = [&] { return passes_ - start < most_products && solve_linear(h, state); };
    const auto rate = [this](const TickContact& contact) {
        double sum = contact.fixed_rate;
        for (int i = 0; i < contact.count; ++i) {
            const Index l = contacts_.spot(contact.vertex[at(i)]);
            sum += contact.weight[at(i)] * solution_.col(l).dot(contact.normal);
        }
        return sum;
    };
    return trocar::find_active(contacts_.all(), h, solved, rate);
}

/// Projected Gauss-Seidel for a bounded number of sweeps. It is not exact, but the tissue receives the forces that the
/// contacts report. It starts from zero force, so that an unconverged solution gives less energy, never more.
void ContactSolver::sweep(double h, TissueState& state) {
    constexpr int most_sweeps = 100;
    constexpr double tolerance = 1e-4;  // of the largest force
    for (TickContact& contact : contacts_.all()) contact.force = 0.0;
    for (int i = 0; i < most_sweeps; ++i) {
        ++passes_;
        double largest = 0.0;
        double change = 0.0;
        for (TickContact& contact : contacts_.all()) {
            const double force = force_alone(h, contact, TickContacts::rate(contact, state));
            push(contact, h * (force - contact.force), state);
            change = std::max(change, std::abs(force - contact.force));
            largest = std::max(largest, std::abs(force));
            contact.force = force;
        }
        if (change <= tolerance * largest) break;
    }
}

/// Force of a contact with all others fixed; `speed` is its rate under its current force.
double ContactSolver::force_alone(double h, const TickContact& contact, double speed) {
    const StepLaw law = contact.law(h);
    const double response = h * contact.mobility;  // m/s per N
    const double force = (law.force(speed - response * contact.force) + contact.held) / (1.0 + law.slope * response);
    if (contact.bilateral) return contact.within_limit(force);
    if (contact.pulls) return contact.depth >= 0.0 ? contact.within_limit(force) : 0.0;
    return contact.within_limit(std::max(force, 0.0));
}

void ContactSolver::rub(double h, TissueState& state) {
    if (!contacts_.any_has_friction()) return;
    contacts_.gather_anchor();
    for (std::size_t a = 0; a < contacts_.all().size(); ++a) {
        TickContact& contact = contacts_.all()[a];
        if (!contact.has_friction) continue;
        contact.rubbed.setZero();
        if (!contacts_.anchors(a)) continue;
        contacts_.rub(a, h, TickContacts::speed(contact, state));
        for (int i = 0; i < contact.count; ++i) {
            const Index v = contact.vertex[at(i)];
            velocity_of(state, v) += h * contact.weight[at(i)] * state.inverse_mass[at(v)] * contact.rubbed;
        }
    }
}

}  // namespace trocar
