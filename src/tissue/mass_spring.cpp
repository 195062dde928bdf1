#include "tissue/mass_spring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

bool is_free(const Materials& materials, Index vertex) {
    return materials.mass[at(vertex)] > 0.0 && (materials.pinned.empty() || materials.pinned[at(vertex)] == 0);
}

/// False: what was handed over is not finite already, so that the integrator is not to blame.
bool finite_input(const Effect& effect, const Frame& frame) {
    const auto all_finite = [](const LinearContact& contact) {
        return std::isfinite(contact.gap) && std::isfinite(contact.k) && std::isfinite(contact.mu) &&
               std::isfinite(contact.face_velocity) && contact.normal.allFinite() &&
               std::all_of(contact.weights.begin(), contact.weights.end(), [](double w) { return std::isfinite(w); }) &&
               std::all_of(contact.reaction_weights.begin(), contact.reaction_weights.end(),
                           [](double w) { return std::isfinite(w); });
    };
    return frame.position.allFinite() && frame.velocity.allFinite() && effect.held_force.allFinite() &&
           std::all_of(effect.contacts.begin(), effect.contacts.end(), all_finite) &&
           std::all_of(effect.placements.begin(), effect.placements.end(), [](const Placement& placement) {
               return placement.position.allFinite() && placement.velocity.allFinite();
           });
}

/// Linearised stiffness of one spring: k along it, tension over length across it (thesis §3.2, preload).
Matrix3 stiffness_block(const Spring& spring, const Matrix3X& position) {
    const Vector3 d = position.col(spring.j) - position.col(spring.i);
    const double length = d.norm();
    if (length == 0.0) return spring.k * Matrix3::Identity();
    const Vector3 u = d / length;
    const double tension = spring.k * (length - spring.rest) + spring.preload;
    const Matrix3 along = u * u.transpose();
    return spring.k * along + tension / length * (Matrix3::Identity() - along);
}

}  // namespace

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
    for (std::size_t v = 0; v < materials.drag.size(); ++v) {
        const auto column = static_cast<Eigen::Index>(v);
        if (materials.drag[v] != 0.0) force.col(column) -= materials.drag[v] * velocity.col(column);
    }
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

MassSpring::MassSpring(const Topology& topology, const Materials& materials) : materials_(&materials) {
    const Index n = topology.vertex_count;
    inverse_mass_.assign(at(n), 0.0);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            tissue_.push_back(v);
            if (!is_free(materials, v)) continue;
            free_.push_back(v);
            inverse_mass_[at(v)] = 1.0 / materials.mass[at(v)];
        }
    }
    for (const Spring& spring : materials.springs) extent_ += spring.rest;
    position_.setZero(3, n);
    velocity_.setZero(3, n);
    start_.setZero(3, n);
    force_.setZero(3, n);
    local_.assign(at(n), -1);
    slip_.setZero(3, n);
    rubbed_.assign(at(n), 0);
    rubbing_.reserve(at(n));
    touched_.reserve(free_.size());
    block_inverse_.reserve(free_.size());
    const auto columns = static_cast<Eigen::Index>(free_.size());
    for (Matrix3X* buffer : {&right_side_, &solution_, &residual_, &direction_, &image_, &preconditioned_}) {
        buffer->setZero(3, columns);
    }
    limited_.assign(materials.springs.size(), 0);
}

/// Contacts that touch at least one vertex this object moves, with the rest folded into fixed_rate.
void MassSpring::collect(const Effect& effect, const Frame& frame) {
    for (const Index v : touched_) local_[at(v)] = -1;
    touched_.clear();
    active_.clear();
    mean_force_.assign(effect.contacts.size(), 0.0);
    mean_friction_.assign(effect.contacts.size(), Vector3::Zero());
    // A contact that was not in the last tick's effect starts with an unstretched tangential spring.
    std::erase_if(rubbing_, [this](Index v) { return --rubbed_[at(v)] == 0; });
    for (std::size_t c = 0; c < effect.contacts.size(); ++c) {
        const LinearContact& contact = effect.contacts[c];
        Active entry;
        entry.source = c;
        entry.normal = contact.normal;
        entry.depth = -contact.gap;
        entry.stiffness = contact.k;
        entry.damping = std::max(contact.mu, 0.0);
        entry.explicit_damping = std::min(contact.mu, 0.0);
        entry.adhesive = contact.adhesive;
        entry.bilateral = contact.bilateral;
        const auto add = [&](Index vertex, double weight) {
            if (vertex < 0 || weight == 0.0) return;
            if (inverse_mass_[at(vertex)] > 0.0) {
                entry.vertex[at(entry.count)] = vertex;
                entry.weight[at(entry.count)] = weight;
                ++entry.count;
            } else {
                entry.fixed_rate += weight * velocity_.col(vertex).dot(contact.normal);
                entry.surface -= weight * velocity_.col(vertex);
            }
        };
        for (std::size_t i = 0; i < 3; ++i) add(contact.vertices[i], contact.weights[i]);
        if (contact.reaction_vertices[0] >= 0) {
            for (std::size_t i = 0; i < 3; ++i) add(contact.reaction_vertices[i], -contact.reaction_weights[i]);
        } else {
            entry.fixed_rate -= contact.face_velocity;
            entry.surface += contact.surface_velocity;
        }
        if (entry.count == 0) continue;
        if (contact.friction > 0.0 && contact.slip_key >= 0 && rubbed_[at(contact.slip_key)] < 2) {
            entry.rubs = true;  // one contact per key: the spring has one stretch
            if (rubbed_[at(contact.slip_key)] == 0) {
                slip_.col(contact.slip_key).setZero();
                rubbing_.push_back(contact.slip_key);
            }
            rubbed_[at(contact.slip_key)] = 2;
        }
        const double speed = rate(entry, frame.velocity);
        entry.held = entry.stiffness * entry.depth - contact.mu * speed;
        if (!entry.adhesive && !entry.bilateral) entry.held = std::max(entry.held, 0.0);
        if (!entry.bilateral && entry.depth < 0.0) entry.held = 0.0;
        for (int i = 0; i < entry.count; ++i) {
            const Index v = entry.vertex[at(i)];
            if (local_[at(v)] >= 0) continue;
            local_[at(v)] = static_cast<Index>(touched_.size());
            touched_.push_back(v);
        }
        active_.push_back(entry);
    }
    block_inverse_.resize(touched_.size());
}

double MassSpring::rate(const Active& contact, const Matrix3X& velocity) const {
    double sum = contact.fixed_rate;
    for (int i = 0; i < contact.count; ++i) {
        sum += contact.weight[at(i)] * velocity.col(contact.vertex[at(i)]).dot(contact.normal);
    }
    return sum;
}

void MassSpring::push(const Active& contact, double impulse, Matrix3X& velocity) const {
    for (int i = 0; i < contact.count; ++i) {
        const Index v = contact.vertex[at(i)];
        velocity.col(v) += contact.weight[at(i)] * impulse * inverse_mass_[at(v)] * contact.normal;
    }
}

/// Backward Euler of all contacts that are on: (M + h Σ c Jᵀ J) v' = M v + h Σ (k d − c r) Jᵀ with c = mu + h k and r
/// the fixed part of the rate. Conjugate gradients with the exact 3×3 blocks of the vertices as preconditioner, so that
/// contacts that move one vertex each are solved exactly before the first iteration.
void MassSpring::solve_linear(double h) {
    const auto count = static_cast<Eigen::Index>(touched_.size());
    for (Eigen::Index l = 0; l < count; ++l) {
        const Index v = touched_[static_cast<std::size_t>(l)];
        const double mass = materials_->mass[at(v)];
        block_inverse_[static_cast<std::size_t>(l)] = mass * Matrix3::Identity();
        right_side_.col(l) = mass * velocity_.col(v);
    }
    for (const Active& contact : active_) {
        if (!contact.on) continue;
        const double c = contact.damping + h * contact.stiffness;
        const double pressure = contact.stiffness * contact.depth - c * contact.fixed_rate + contact.held;
        for (int i = 0; i < contact.count; ++i) {
            const Index l = local_[at(contact.vertex[at(i)])];
            const double w = contact.weight[at(i)];
            right_side_.col(l) += h * pressure * w * contact.normal;
            block_inverse_[at(l)] += h * c * w * w * contact.normal * contact.normal.transpose();
        }
    }
    double squared_size = 0.0;
    for (Eigen::Index l = 0; l < count; ++l) {
        Matrix3& block = block_inverse_[static_cast<std::size_t>(l)];
        block = block.inverse().eval();
        solution_.col(l) = block * right_side_.col(l);
        squared_size += right_side_.col(l).squaredNorm();
    }
    const auto apply = [&](const Matrix3X& x, Matrix3X& result) {
        for (Eigen::Index l = 0; l < count; ++l) {
            result.col(l) = materials_->mass[at(touched_[static_cast<std::size_t>(l)])] * x.col(l);
        }
        for (const Active& contact : active_) {
            if (!contact.on) continue;
            double sum = 0.0;
            for (int i = 0; i < contact.count; ++i) {
                sum += contact.weight[at(i)] * x.col(local_[at(contact.vertex[at(i)])]).dot(contact.normal);
            }
            sum *= h * (contact.damping + h * contact.stiffness);
            for (int i = 0; i < contact.count; ++i) {
                result.col(local_[at(contact.vertex[at(i)])]) += contact.weight[at(i)] * sum * contact.normal;
            }
        }
    };
    const auto dot = [count](const Matrix3X& a, const Matrix3X& b) {
        double sum = 0.0;
        for (Eigen::Index l = 0; l < count; ++l) sum += a.col(l).dot(b.col(l));
        return sum;
    };
    const auto precondition = [&] {
        for (Eigen::Index l = 0; l < count; ++l) {
            preconditioned_.col(l) = block_inverse_[static_cast<std::size_t>(l)] * residual_.col(l);
        }
    };
    constexpr int most_iterations = 60;
    constexpr double tolerance = 1e-13;
    apply(solution_, image_);
    for (Eigen::Index l = 0; l < count; ++l) residual_.col(l) = right_side_.col(l) - image_.col(l);
    precondition();
    for (Eigen::Index l = 0; l < count; ++l) direction_.col(l) = preconditioned_.col(l);
    double rho = dot(residual_, preconditioned_);
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
        if (dot(residual_, residual_) <= tolerance * tolerance * squared_size) break;
        apply(direction_, image_);
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
}

/// Finds which contacts are on in this sub-step and leaves the new velocities of the touched vertices in velocity_.
void MassSpring::solve_contacts(double h) {
    for (Active& contact : active_) {
        contact.on = contact.bilateral || contact.depth >= 0.0;
        // Negative damping from the velocity at the start of the sub-step.
        contact.held = contact.on ? -contact.explicit_damping * rate(contact, velocity_) : 0.0;
    }
    // All that have to change at once settle most sub-steps in a few rounds. Where many contacts share few vertices
    // that may go round in circles; one at a time, always the first, cannot (Murty 1974, least index).
    constexpr int rounds_at_once = 8;
    constexpr int most_changes = 60;
    bool settled = false;
    for (int change = 0; change < most_changes && !settled; ++change) {
        solve_linear(h);
        settled = true;
        for (Active& contact : active_) {
            double new_rate = contact.fixed_rate;
            for (int i = 0; i < contact.count; ++i) {
                const Index l = local_[at(contact.vertex[at(i)])];
                new_rate += contact.weight[at(i)] * solution_.col(l).dot(contact.normal);
            }
            const double new_depth = contact.depth - h * new_rate;
            const double force = contact.stiffness * new_depth - contact.damping * new_rate + contact.held;
            contact.force = contact.on ? force : 0.0;
            if (contact.bilateral || contact.adhesive) continue;
            const bool leaves = contact.on && force < 0.0;
            const bool joins = !contact.on && force > 0.0 && new_depth > 0.0;
            if (leaves) contact.force = 0.0;
            if (!leaves && !joins) continue;
            if (change < rounds_at_once || settled) contact.on = joins;
            settled = false;
        }
    }
    if (!settled) sweep_contacts(h);
    for (std::size_t l = 0; l < touched_.size(); ++l) {
        velocity_.col(touched_[l]) = solution_.col(static_cast<Eigen::Index>(l));
    }
}

/// Projected Gauss-Seidel from the forces that the search for the contacts that are on has come to: not exact, but
/// what every contact is said to give is what the tissue gets.
void MassSpring::sweep_contacts(double h) {
    for (std::size_t l = 0; l < touched_.size(); ++l) {
        solution_.col(static_cast<Eigen::Index>(l)) = velocity_.col(touched_[l]);
    }
    const auto push = [&](const Active& contact, double impulse) {
        for (int i = 0; i < contact.count; ++i) {
            const Index v = contact.vertex[at(i)];
            solution_.col(local_[at(v)]) += impulse * contact.weight[at(i)] * inverse_mass_[at(v)] * contact.normal;
        }
    };
    for (const Active& contact : active_) push(contact, h * contact.force);
    constexpr int sweeps = 200;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        for (Active& contact : active_) {
            double rate = contact.fixed_rate;
            double mobility = 0.0;
            for (int i = 0; i < contact.count; ++i) {
                const Index v = contact.vertex[at(i)];
                const double w = contact.weight[at(i)];
                rate += w * solution_.col(local_[at(v)]).dot(contact.normal);
                mobility += w * w * inverse_mass_[at(v)];
            }
            const double c = contact.damping + h * contact.stiffness;
            double force =
                (contact.stiffness * contact.depth + contact.held - c * (rate - h * mobility * contact.force)) /
                (1.0 + c * h * mobility);
            const bool acts = contact.depth >= 0.0 || contact.depth - h * rate > 0.0;
            if (!contact.bilateral && (!acts || (!contact.adhesive && force < 0.0))) force = 0.0;
            push(contact, h * (force - contact.force));
            contact.force = force;
        }
    }
}

Outcome MassSpring::advance(const Effect& effect, double dt, Frame& frame, std::vector<Wrench>& reaction) {
    velocity_ = frame.velocity;
    position_ = frame.position;
    for (const Placement& placement : effect.placements) {
        if (inverse_mass_[at(placement.vertex)] == 0.0) continue;  // pinned
        position_.col(placement.vertex) = placement.position;
        velocity_.col(placement.vertex) = placement.velocity;
        if (placement.held) inverse_mass_[at(placement.vertex)] = 0.0;
    }
    Outcome outcome = integrate(effect, dt, frame, reaction);
    for (const Placement& placement : effect.placements) {
        if (placement.held && is_free(*materials_, placement.vertex)) {
            inverse_mass_[at(placement.vertex)] = 1.0 / materials_->mass[at(placement.vertex)];
        }
    }
    return outcome;
}

/// Coulomb friction of the contacts that press, after the normal forces of the sub-step are known.
void MassSpring::rub(double h, const Effect& effect) {
    for (Active& contact : active_) {
        if (!contact.rubs) continue;
        contact.rubbed.setZero();
        const LinearContact& source = effect.contacts[contact.source];
        auto slip = slip_.col(source.slip_key);
        if (contact.force <= 0.0) {
            slip.setZero();
            continue;
        }
        Vector3 speed = -contact.surface;
        double mobility = 0.0;
        for (int i = 0; i < contact.count; ++i) {
            speed += contact.weight[at(i)] * velocity_.col(contact.vertex[at(i)]);
            mobility += contact.weight[at(i)] * contact.weight[at(i)] * inverse_mass_[at(contact.vertex[at(i)])];
        }
        speed -= speed.dot(contact.normal) * contact.normal;
        Vector3 stretch = slip;
        stretch -= stretch.dot(contact.normal) * contact.normal;
        const double damping = 2.0 * std::sqrt(source.tangent_k / mobility);
        const Vector3 sticking = -(source.tangent_k * (stretch + h * speed) + damping * speed) /
                                 (1.0 + h * mobility * (damping + h * source.tangent_k));
        const double most = source.friction * contact.force;
        const double wanted = sticking.norm();
        const bool slides = wanted > most;
        contact.rubbed = slides ? Vector3(most / wanted * sticking) : sticking;
        for (int i = 0; i < contact.count; ++i) {
            const Index v = contact.vertex[at(i)];
            velocity_.col(v) += h * contact.weight[at(i)] * inverse_mass_[at(v)] * contact.rubbed;
        }
        if (slides) {
            slip = source.tangent_k > 0.0 ? Vector3(-contact.rubbed / source.tangent_k) : Vector3::Zero();
        } else {
            slip = stretch + h * (speed + h * mobility * contact.rubbed);
        }
        mean_friction_[contact.source] += contact.rubbed / std::max(1, materials_->substeps);
    }
}

Outcome MassSpring::integrate(const Effect& effect, double dt, Frame& frame, std::vector<Wrench>& reaction) {
    start_ = position_;
    collect(effect, frame);
    const bool held = effect.contacts_held;
    const bool explicit_contacts = effect.contacts_explicit && !held;
    const int substeps = std::max(1, materials_->substeps);
    const double h = dt / substeps;
    const bool external = effect.held_force.cols() == position_.cols();
    for (int substep = 0; substep < substeps; ++substep) {
        internal_force(*materials_, position_, velocity_, force_);
        if (explicit_contacts) {
            for (Active& contact : active_) {
                const double speed = rate(contact, velocity_);
                double force = contact.stiffness * contact.depth - (contact.damping + contact.explicit_damping) * speed;
                if (!contact.bilateral && (contact.depth < 0.0 || (!contact.adhesive && force < 0.0))) force = 0.0;
                contact.held = force;
            }
        }
        for (const Index v : free_) {
            if (inverse_mass_[at(v)] == 0.0) continue;  // held for this tick
            if (external) force_.col(v) += effect.held_force.col(v);
            velocity_.col(v) += h * inverse_mass_[at(v)] * force_.col(v);
        }
        if (held || explicit_contacts) {
            for (Active& contact : active_) {
                contact.force = contact.held;
                push(contact, h * contact.force, velocity_);
            }
        } else if (!active_.empty()) {
            solve_contacts(h);
        }
        if (!rubbing_.empty()) rub(h, effect);
        for (Active& contact : active_) {
            contact.depth -= h * rate(contact, velocity_);
            mean_force_[contact.source] += contact.force / substeps;
        }
        double furthest = 0.0;
        bool finite = true;
        for (const Index v : free_) {
            if (inverse_mass_[at(v)] != 0.0) position_.col(v) += h * velocity_.col(v);
            const double moved = (position_.col(v) - start_.col(v)).squaredNorm();
            finite = finite && std::isfinite(moved) && velocity_.col(v).allFinite();
            furthest = std::max(furthest, moved);
        }
        // Every sub-step, so that a scheme that blows up is told before its numbers overflow.
        if (!finite && !finite_input(effect, frame)) {
            return {OutcomeKind::not_finite, "a tissue vertex left the finite numbers"};
        }
        if (!finite || (extent_ > 0.0 && furthest > extent_ * extent_)) {
            return {OutcomeKind::unstable, "a tissue vertex moved further in one tick than all springs are long"};
        }
    }
    limit_strain();
    if (limited_edges_ > 0 && blows_up(dt)) {
        return {OutcomeKind::unstable,
                fmt::format("sub-steps of {:.3g} ms are beyond the stability limit; only the strain limit holds the "
                            "springs together ({} sub-steps a tick are stable)",
                            h * 1e3, stable_substeps(*materials_, start_, dt))};
    }

    for (const Index v : tissue_) {
        frame.previous.col(v) = start_.col(v);
        frame.position.col(v) = position_.col(v);
        frame.velocity.col(v) = velocity_.col(v);
    }
    for (const Active& contact : active_) {
        const LinearContact& source = effect.contacts[contact.source];
        if (source.reaction_body < 0) continue;
        const Vector3 force = -mean_force_[contact.source] * source.normal - mean_friction_[contact.source];
        Wrench& wrench = reaction[at(source.reaction_body)];
        wrench.force += force;
        wrench.moment += source.reaction_point.cross(force);
    }
    return {};
}

/// Whether the limiter hides a scheme that blows up. Asked when the limiter acts, from the place at the start of the
/// tick, and then after every 64 such ticks only.
bool MassSpring::blows_up(double dt) {
    constexpr std::int64_t seldom = 64;
    if (limited_ticks_++ % seldom != 0) return false;
    const int substeps = std::max(1, materials_->substeps);
    if (substeps >= stable_substeps(*materials_, start_, dt)) return false;
    return surely_unstable(*materials_, start_, dt / substeps);
}

/// Two passes of Provot's correction: an edge that is too long is brought back to the limit by its ends' inverse
/// masses, and the part of their relative velocity that would lengthen it again is taken away.
void MassSpring::limit_strain() {
    const double longest = 1.0 + materials_->strain_limit;
    std::fill(limited_.begin(), limited_.end(), std::uint8_t{0});
    for (int pass = 0; pass < 2; ++pass) {
        for (std::size_t s = 0; s < materials_->springs.size(); ++s) {
            const Spring& spring = materials_->springs[s];
            const double sum = inverse_mass_[at(spring.i)] + inverse_mass_[at(spring.j)];
            if (spring.rest <= 0.0 || sum == 0.0) continue;
            const Vector3 d = position_.col(spring.j) - position_.col(spring.i);
            const double length = d.norm();
            if (length <= longest * spring.rest) continue;
            limited_[s] = 1;
            const Vector3 u = d / length;
            const Vector3 correction = (length - longest * spring.rest) / sum * u;
            position_.col(spring.i) += inverse_mass_[at(spring.i)] * correction;
            position_.col(spring.j) -= inverse_mass_[at(spring.j)] * correction;
            const double opening = (velocity_.col(spring.j) - velocity_.col(spring.i)).dot(u);
            if (opening <= 0.0) continue;
            velocity_.col(spring.i) += inverse_mass_[at(spring.i)] / sum * opening * u;
            velocity_.col(spring.j) -= inverse_mass_[at(spring.j)] / sum * opening * u;
        }
    }
    limited_edges_ = std::count(limited_.begin(), limited_.end(), std::uint8_t{1});
    max_strain_ = 0.0;
    for (const Spring& spring : materials_->springs) {
        if (spring.rest <= 0.0) continue;
        const double length = (position_.col(spring.j) - position_.col(spring.i)).norm();
        max_strain_ = std::max(max_strain_, length / spring.rest - 1.0);
    }
}

}  // namespace trocar
