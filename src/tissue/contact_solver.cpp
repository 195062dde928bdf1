#include "tissue/contact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

int count_of(const std::array<Index, 3>& vertices) {
    return static_cast<int>(std::count_if(vertices.begin(), vertices.end(), [](Index v) { return v >= 0; }));
}

/// Of the points on two lines that are nearest to each other, how far along each, in [0, 1].
std::pair<double, double> closest_on_edges(const Vector3& a0, const Vector3& along_a, const Vector3& b0,
                                           const Vector3& along_b) {
    const Vector3 across = along_a.cross(along_b);
    const double square = across.squaredNorm();
    const Vector3 between = b0 - a0;
    return {std::clamp(between.cross(along_b).dot(across) / square, 0.0, 1.0),
            std::clamp(between.cross(along_a).dot(across) / square, 0.0, 1.0)};
}

auto velocity_of(const TissueState& state, Index local) { return state.velocity.col(local).head<3>(); }
auto velocity_of(TissueState& state, Index local) { return state.velocity.col(local).head<3>(); }

}  // namespace

ContactSolver::ContactSolver(Index vertex_count, std::size_t moving) {
    slip_.setZero(3, vertex_count);
    rubbed_.assign(at(vertex_count), 0);
    grip_.assign(at(vertex_count), {});
    rubbing_.reserve(at(vertex_count));
    spot_.assign(at(vertex_count), -1);
    touched_.reserve(moving);
    mass_.reserve(moving);
    block_inverse_.reserve(moving);
    const auto columns = static_cast<Eigen::Index>(moving);
    for (Matrix3X* buffer : {&right_side_, &solution_, &residual_, &direction_, &image_, &preconditioned_}) {
        buffer->setZero(3, columns);
    }
}

void ContactSolver::collect(const Effect& effect, const Frame& frame, const TissueState& state) {
    effect_ = &effect;
    for (const Index v : touched_) spot_[at(v)] = -1;
    touched_.clear();
    mass_.clear();
    active_.clear();
    crowded_ = false;
    passes_ = 0;
    elapsed_ = 0.0;
    mean_normal_.assign(effect.contacts.size(), Vector3::Zero());
    loads_.assign(effect.contacts.size(), {});
    mean_friction_.assign(effect.contacts.size(), Vector3::Zero());
    // A contact that was not in the last tick's effect starts with an unstretched tangential spring.
    std::erase_if(rubbing_, [this](Index v) { return --rubbed_[at(v)] == 0; });
    for (std::size_t c = 0; c < effect.contacts.size(); ++c) {
        Active entry;
        entry.source = c;
        if (!enter(effect.contacts[c], frame, state, entry)) continue;
        remember_slip(effect.contacts[c], entry);
        loads_[c].work = 0.0;
        for (int i = 0; i < entry.count; ++i) {
            const Index v = entry.vertex[at(i)];
            if (spot_[at(v)] >= 0) continue;
            spot_[at(v)] = static_cast<Index>(touched_.size());
            touched_.push_back(v);
            mass_.push_back(1.0 / state.inverse_mass[at(v)]);
        }
        active_.push_back(entry);
    }
    block_inverse_.resize(touched_.size());
}

/// False when nothing of the contact moves here.
bool ContactSolver::enter(const LinearContact& contact, const Frame& frame, const TissueState& state, Active& entry) {
    entry.normal = contact.normal;
    entry.depth = -contact.gap;
    entry.stiffness = contact.k;
    entry.damping = std::max(contact.mu, 0.0);
    entry.explicit_damping = std::min(contact.mu, 0.0);
    entry.adhesive = contact.adhesive;
    entry.bilateral = contact.bilateral();
    entry.limit = contact.limit;
    double speed = 0.0;  // of P at the frame
    const auto add = [&](Index vertex, double weight) {
        if (vertex < 0 || weight == 0.0) return;
        const Index local = state.place[at(vertex)];
        if (local >= 0 && state.moves(local)) {
            entry.vertex[at(entry.count)] = local;
            entry.weight[at(entry.count)] = weight;
            entry.mobility += weight * weight * state.inverse_mass[at(local)];
            ++entry.count;
            speed += weight * frame.velocity.col(vertex).dot(contact.normal);
        } else {
            const Vector3 velocity = local >= 0 ? Vector3(velocity_of(state, local)) : frame.velocity.col(vertex);
            entry.fixed_rate += weight * velocity.dot(contact.normal);
            entry.surface -= weight * velocity;
        }
    };
    for (std::size_t i = 0; i < 3; ++i) add(contact.vertices[i], contact.weights[i]);
    if (contact.reaction_vertices[0] >= 0) {
        for (std::size_t i = 0; i < 3; ++i) add(contact.reaction_vertices[i], -contact.reaction_weights[i]);
    } else {
        entry.fixed_rate -= contact.face_velocity;
        entry.surface += contact.surface_velocity;
    }
    if (entry.count == 0) return false;
    // Only what a source's contact is held by tells where the other side is at the start of the tick (reaction_point).
    // Tissue that nothing can move has no place in the state, and no motion to follow.
    const auto in_state = [&state](Index vertex) { return vertex < 0 || state.place[at(vertex)] >= 0; };
    entry.turns = contact.role == ContactRole::constraint && contact.source_id != 0 &&
                  std::all_of(contact.vertices.begin(), contact.vertices.end(), in_state) &&
                  std::all_of(contact.reaction_vertices.begin(), contact.reaction_vertices.end(), in_state);
    const int corners = count_of(contact.vertices);
    const int others = count_of(contact.reaction_vertices);
    if (others == 0) {
        entry.turns = entry.turns && (corners == 3 || (corners == 2 && !contact.other_edge.isZero()));
    } else {
        entry.turns = entry.turns && corners + others == 4;  // a vertex and a face, or two edges
    }
    entry.held = entry.stiffness * entry.depth - contact.mu * (entry.fixed_rate + speed);
    if (!entry.adhesive && !entry.bilateral) entry.held = std::max(entry.held, 0.0);
    if (!entry.bilateral && entry.depth < 0.0) entry.held = 0.0;
    entry.held = within_limit(entry, entry.held);
    return true;
}

double ContactSolver::within_limit(const Active& contact, double force) {
    return std::clamp(force, -contact.limit, contact.limit);
}

/// A contact whose law says `force` and that presses or pulls more than it may.
bool ContactSolver::reaches_limit(const Active& contact, double force) {
    const bool pulls = contact.bilateral || contact.adhesive;
    return contact.on && !contact.capped && (force > contact.limit || (pulls && force < -contact.limit));
}

bool ContactSolver::leaves_limit(const Active& contact, double force) {
    return contact.force >= 0.0 ? force < contact.limit : force > -contact.limit;
}

void ContactSolver::remember_slip(const LinearContact& contact, Active& entry) {
    const Index key = contact.slip_key;
    if (contact.friction <= 0.0 || key < 0) return;
    entry.rubs = true;
    if (at(key) >= rubbed_.size()) {
        const auto known = static_cast<Eigen::Index>(rubbed_.size());
        slip_.conservativeResize(3, key + 1);
        slip_.rightCols(key + 1 - known).setZero();
        rubbed_.resize(at(key) + 1, 0);
        grip_.resize(at(key) + 1);
    }
    if (rubbed_[at(key)] == 0) {
        slip_.col(key).setZero();
        rubbing_.push_back(key);
    }
    rubbed_[at(key)] = 2;
}

double ContactSolver::rate(const Active& contact, const TissueState& state) const {
    double sum = contact.fixed_rate;
    for (int i = 0; i < contact.count; ++i) {
        sum += contact.weight[at(i)] * velocity_of(state, contact.vertex[at(i)]).dot(contact.normal);
    }
    return sum;
}

void ContactSolver::push(const Active& contact, double impulse, TissueState& state) const {
    for (int i = 0; i < contact.count; ++i) {
        const Index v = contact.vertex[at(i)];
        velocity_of(state, v) += contact.weight[at(i)] * impulse * state.inverse_mass[at(v)] * contact.normal;
    }
}

void ContactSolver::hold_current_force(const TissueState& state) {
    for (Active& contact : active_) {
        const double speed = rate(contact, state);
        double force = contact.stiffness * contact.depth - (contact.damping + contact.explicit_damping) * speed;
        if (!contact.bilateral && (contact.depth < 0.0 || (!contact.adhesive && force < 0.0))) force = 0.0;
        contact.held = within_limit(contact, force);
    }
}

void ContactSolver::push_held(double h, TissueState& state) {
    for (Active& contact : active_) {
        contact.force = contact.held;
        push(contact, h * contact.force, state);
    }
}

/// Right-hand side and diagonal blocks of solve_linear; the blocks are inverted.
void ContactSolver::assemble(double h, const TissueState& state) {
    const auto count = static_cast<Eigen::Index>(touched_.size());
    for (Eigen::Index l = 0; l < count; ++l) {
        const auto spot = static_cast<std::size_t>(l);
        block_inverse_[spot] = mass_[spot] * Matrix3::Identity();
        right_side_.col(l) = mass_[spot] * velocity_of(state, touched_[spot]);
    }
    for (const Active& contact : active_) {
        if (!contact.on) continue;
        if (contact.capped) {
            for (int i = 0; i < contact.count; ++i) {
                right_side_.col(spot_[at(contact.vertex[at(i)])]) +=
                    h * contact.force * contact.weight[at(i)] * contact.normal;
            }
            continue;
        }
        const double c = contact.damping + h * contact.stiffness;
        const double pressure = contact.stiffness * contact.depth - c * contact.fixed_rate + contact.held;
        for (int i = 0; i < contact.count; ++i) {
            const Index l = spot_[at(contact.vertex[at(i)])];
            const double w = contact.weight[at(i)];
            right_side_.col(l) += h * pressure * w * contact.normal;
            block_inverse_[at(l)] += h * c * w * w * contact.normal * contact.normal.transpose();
        }
    }
    for (Matrix3& block : block_inverse_) block = block.inverse().eval();
}

/// The matrix of solve_linear times velocities of the touched vertices.
void ContactSolver::apply(double h, const Matrix3X& velocity, Matrix3X& result) {
    ++passes_;
    for (std::size_t l = 0; l < touched_.size(); ++l) {
        const auto column = static_cast<Eigen::Index>(l);
        result.col(column) = mass_[l] * velocity.col(column);
    }
    for (const Active& contact : active_) {
        if (!contact.on || contact.capped) continue;
        double sum = 0.0;
        for (int i = 0; i < contact.count; ++i) {
            sum += contact.weight[at(i)] * velocity.col(spot_[at(contact.vertex[at(i)])]).dot(contact.normal);
        }
        sum *= h * (contact.damping + h * contact.stiffness);
        for (int i = 0; i < contact.count; ++i) {
            result.col(spot_[at(contact.vertex[at(i)])]) += contact.weight[at(i)] * sum * contact.normal;
        }
    }
}

void ContactSolver::precondition() {
    for (std::size_t l = 0; l < touched_.size(); ++l) {
        const auto column = static_cast<Eigen::Index>(l);
        preconditioned_.col(column) = block_inverse_[l] * residual_.col(column);
    }
}

/// Backward Euler of all contacts that are on: (M + h Σ c Jᵀ J) v' = M v + h Σ (k d − c r) Jᵀ with c = mu + h k and r
/// the fixed part of the rate; one at its limit is a constant force on the right-hand side. Conjugate gradients with
/// the exact 3×3 blocks of the vertices as preconditioner, so that contacts that move one vertex each are solved
/// exactly before the first iteration. False when they end before the solution is one.
bool ContactSolver::solve_linear(double h, const TissueState& state) {
    assemble(h, state);
    const auto count = static_cast<Eigen::Index>(touched_.size());
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

void ContactSolver::turn(const TissueState& state) {
    for (Active& contact : active_) {
        if (!contact.turns) continue;
        const LinearContact& given = effect_->contacts[contact.source];
        if (given.reaction_vertices[0] >= 0) {
            turn_tissues(state, contact);
            continue;
        }
        const auto corner = [&](std::size_t i) -> Vector3 {
            return state.position.col(state.place[at(given.vertices[i])]).head<3>();
        };
        const Vector3 point = given.reaction_point + elapsed_ * given.surface_velocity;
        const Vector3& edge = given.other_edge;
        const Vector3 first = corner(0);
        const Vector3 second = corner(1);
        const bool of_edges = given.vertices[2] < 0;
        const Vector3 third = of_edges ? Vector3(first + edge) : corner(2);
        Vector3 normal = (second - first).cross(third - first);
        const double size = normal.norm();
        if (size == 0.0) continue;
        normal /= normal.dot(contact.normal) < 0.0 ? -size : size;
        Vector3 weights;
        if (of_edges) {
            // Seen along the other edge, both lie in one plane.
            const auto flat = [&edge](const Vector3& v) { return Vector3(v - v.dot(edge) * edge); };
            const Vector3 along = flat(second - first);
            const double way = std::clamp(flat(point - first).dot(along) / along.squaredNorm(), 0.0, 1.0);
            weights = {1.0 - way, way, 0.0};
        } else {
            weights = closest_point_on_triangle({first, second, third}, point);
        }
        take_weights(state, weights, Vector3::Zero(), normal, contact);
    }
}

/// Of two tissues, a vertex and a face or two edges: both sides are where the last sub-step left them.
void ContactSolver::turn_tissues(const TissueState& state, Active& contact) const {
    const LinearContact& given = effect_->contacts[contact.source];
    const auto corners = [&](const std::array<Index, 3>& vertices) {
        Matrix3 places = Matrix3::Zero();
        for (int i = 0; i < count_of(vertices); ++i) {
            places.col(i) = state.position.col(state.place[at(vertices[at(i)])]).head<3>();
        }
        return places;
    };
    const Matrix3 pushed = corners(given.vertices);
    const Matrix3 other = corners(given.reaction_vertices);
    Vector3 normal;
    Vector3 weights = Vector3::UnitX();
    Vector3 other_weights = Vector3::UnitX();
    if (count_of(given.vertices) == 2) {
        const Vector3 along = pushed.col(1) - pushed.col(0);
        const Vector3 other_along = other.col(1) - other.col(0);
        normal = along.cross(other_along);
        if (normal.isZero(0.0)) return;
        const auto [way, other_way] = closest_on_edges(pushed.col(0), along, other.col(0), other_along);
        weights = {1.0 - way, way, 0.0};
        other_weights = {1.0 - other_way, other_way, 0.0};
    } else {
        const bool is_face = count_of(given.vertices) == 3;
        const Matrix3& face = is_face ? pushed : other;
        normal = (face.col(1) - face.col(0)).cross(face.col(2) - face.col(0));
        (is_face ? weights : other_weights) =
            closest_point_on_triangle({face.col(0), face.col(1), face.col(2)}, is_face ? other.col(0) : pushed.col(0));
    }
    const double size = normal.norm();
    if (size == 0.0) return;
    normal /= normal.dot(contact.normal) < 0.0 ? -size : size;
    take_weights(state, weights, other_weights, normal, contact);
}

/// Nothing changes where none of the weights is on a vertex that moves. `other_weights` count where the other side is
/// tissue.
void ContactSolver::take_weights(const TissueState& state, const Vector3& weights, const Vector3& other_weights,
                                 const Vector3& normal, Active& contact) const {
    const LinearContact& given = effect_->contacts[contact.source];
    const auto each = [&](const auto& act) {
        for (int i = 0; i < 3; ++i) {
            if (given.vertices[at(i)] >= 0) act(state.place[at(given.vertices[at(i)])], weights[i]);
        }
        for (int i = 0; i < 3; ++i) {
            if (given.reaction_vertices[at(i)] >= 0) {
                act(state.place[at(given.reaction_vertices[at(i)])], -other_weights[i]);
            }
        }
    };
    bool yields = false;
    each([&](Index local, double weight) { yields = yields || (weight != 0.0 && state.moves(local)); });
    if (!yields) return;
    contact.normal = normal;
    contact.surface = given.reaction_vertices[0] < 0 ? given.surface_velocity : Vector3(Vector3::Zero());
    contact.mobility = 0.0;
    contact.count = 0;
    each([&](Index local, double weight) {
        if (!state.moves(local)) {
            contact.surface -= weight * velocity_of(state, local);
            return;
        }
        contact.vertex[at(contact.count)] = local;
        contact.weight[at(contact.count)] = weight;
        contact.mobility += weight * weight * state.inverse_mass[at(local)];
        ++contact.count;
    });
    contact.fixed_rate = -contact.surface.dot(normal);
}

void ContactSolver::solve(double h, TissueState& state) {
    for (Active& contact : active_) {
        contact.on = contact.bilateral || contact.depth >= 0.0;
        contact.capped = false;
        // Negative damping from the velocity at the start of the sub-step.
        contact.held = contact.on ? -contact.explicit_damping * rate(contact, state) : 0.0;
    }
    if (!crowded_ && find_active(h, state)) {
        for (std::size_t l = 0; l < touched_.size(); ++l) {
            velocity_of(state, touched_[l]) = solution_.col(static_cast<Eigen::Index>(l));
        }
        return;
    }
    crowded_ = true;
    sweep(h, state);
}

/// Searches for the contacts that are on, and of these for the ones at their limit, every guess solved exactly. False
/// where a guess cannot be (conjugate gradients end too soon for so many vertices), which makes further guesses
/// worthless, or where none of them settles.
bool ContactSolver::find_active(double h, const TissueState& state) {
    // All that have to change at once settle most sub-steps in a few rounds. Where many contacts share few vertices
    // that may go round in circles; one at a time, always the first, cannot (Murty 1974, least index).
    constexpr int rounds_at_once = 8;
    constexpr int most_changes = 60;
    constexpr int most_products = 1500;
    const std::int64_t start = passes_;
    for (int change = 0; change < most_changes && passes_ - start < most_products; ++change) {
        if (!solve_linear(h, state)) return false;
        bool settled = true;
        for (Active& contact : active_) {
            double new_rate = contact.fixed_rate;
            for (int i = 0; i < contact.count; ++i) {
                const Index l = spot_[at(contact.vertex[at(i)])];
                new_rate += contact.weight[at(i)] * solution_.col(l).dot(contact.normal);
            }
            const double new_depth = contact.depth - h * new_rate;
            const double force = contact.stiffness * new_depth - contact.damping * new_rate + contact.held;
            if (contact.capped && !leaves_limit(contact, force)) continue;
            if (contact.capped || reaches_limit(contact, force)) {
                if (change < rounds_at_once || settled) {
                    contact.capped = !contact.capped;
                    contact.force = within_limit(contact, force);
                }
                settled = false;
                continue;
            }
            contact.force = contact.on ? force : 0.0;
            if (contact.bilateral || contact.adhesive) continue;
            const bool leaves = contact.on && force < 0.0;
            const bool joins = !contact.on && force > 0.0 && new_depth > 0.0;
            if (leaves) contact.force = 0.0;
            if (!leaves && !joins) continue;
            if (change < rounds_at_once || settled) contact.on = joins;
            settled = false;
        }
        if (settled) return true;
    }
    return false;
}

/// Projected Gauss-Seidel for a bounded number of sweeps: not exact, but what every contact is said to give is what the
/// tissue gets. From no force at all, so that what is not converged gives less energy, never more.
void ContactSolver::sweep(double h, TissueState& state) {
    constexpr int most_sweeps = 100;
    constexpr double tolerance = 1e-4;  // of the largest force
    for (Active& contact : active_) contact.force = 0.0;
    for (int i = 0; i < most_sweeps; ++i) {
        ++passes_;
        double largest = 0.0;
        double change = 0.0;
        for (Active& contact : active_) {
            const double force = force_alone(h, contact, rate(contact, state));
            push(contact, h * (force - contact.force), state);
            change = std::max(change, std::abs(force - contact.force));
            largest = std::max(largest, std::abs(force));
            contact.force = force;
        }
        if (change <= tolerance * largest) break;
    }
}

/// What a contact gives when all others stay as they are; `speed` is its rate with the force that it gives so far.
double ContactSolver::force_alone(double h, const Active& contact, double speed) {
    const double c = contact.damping + h * contact.stiffness;
    const double response = h * contact.mobility;  // m/s per N
    const double force = (contact.stiffness * contact.depth + contact.held - c * (speed - response * contact.force)) /
                         (1.0 + c * response);
    if (contact.bilateral) return within_limit(contact, force);
    if (contact.depth >= 0.0) return within_limit(contact, contact.adhesive ? force : std::max(force, 0.0));
    // It meets the other side within this sub-step: at most what stops it there, else a damper would throw it back
    // before it has arrived, and whether it acts would change from sweep to sweep.
    const double stop = contact.force + (contact.depth / h - speed) / response;
    return within_limit(contact, std::max(0.0, std::min(force, stop)));
}

void ContactSolver::rub(double h, int substeps, TissueState& state) {
    if (rubbing_.empty()) return;
    gather_grip();
    for (std::size_t a = 0; a < active_.size(); ++a) {
        Active& contact = active_[a];
        if (!contact.rubs) continue;
        contact.rubbed.setZero();
        const LinearContact& source = effect_->contacts[contact.source];
        const Grip& grip = grip_[at(source.slip_key)];
        auto slip = slip_.col(source.slip_key);
        if (grip.most <= 0.0) slip.setZero();
        if (grip.most <= 0.0 || grip.firmest != a) continue;
        Vector3 speed = -contact.surface;
        for (int i = 0; i < contact.count; ++i) {
            speed += contact.weight[at(i)] * velocity_of(state, contact.vertex[at(i)]);
        }
        speed -= speed.dot(contact.normal) * contact.normal;
        Vector3 stretch = slip;
        stretch -= stretch.dot(contact.normal) * contact.normal;
        const double damping = 2.0 * std::sqrt(source.tangent_k / contact.mobility);
        const Vector3 sticking = -(source.tangent_k * (stretch + h * speed) + damping * speed) /
                                 (1.0 + h * contact.mobility * (damping + h * source.tangent_k));
        const double wanted = sticking.norm();
        const bool slides = wanted > grip.most;
        contact.rubbed = slides ? Vector3(grip.most / wanted * sticking) : sticking;
        for (int i = 0; i < contact.count; ++i) {
            const Index v = contact.vertex[at(i)];
            velocity_of(state, v) += h * contact.weight[at(i)] * state.inverse_mass[at(v)] * contact.rubbed;
        }
        if (slides) {
            slip = source.tangent_k > 0.0 ? Vector3(-contact.rubbed / source.tangent_k) : Vector3::Zero();
        } else {
            slip = stretch + h * (speed + h * contact.mobility * contact.rubbed);
        }
        mean_friction_[contact.source] += contact.rubbed / substeps;
    }
}

void ContactSolver::gather_grip() {
    for (const Index key : rubbing_) grip_[at(key)] = {};
    for (std::size_t a = 0; a < active_.size(); ++a) {
        const Active& contact = active_[a];
        if (!contact.rubs || contact.force <= 0.0) continue;
        const LinearContact& source = effect_->contacts[contact.source];
        Grip& grip = grip_[at(source.slip_key)];
        if (grip.most == 0.0 || contact.force > active_[grip.firmest].force) grip.firmest = a;
        grip.most += source.friction * contact.force;
    }
}

void ContactSolver::finish_substep(double h, int substeps, const TissueState& state) {
    elapsed_ += h;
    for (Active& contact : active_) {
        const double speed = rate(contact, state);
        contact.depth -= h * speed;
        ContactLoad& load = loads_[contact.source];
        load.work += h * contact.force * (speed - contact.fixed_rate);
        load.normal += contact.force / substeps;
        mean_normal_[contact.source] += contact.force / substeps * contact.normal;
        load.at_limit = std::abs(contact.force) >= contact.limit;
        if (!contact.rubs) continue;
        load.slip += slip_.col(effect_->contacts[contact.source].slip_key).norm() / substeps;
        for (int i = 0; i < contact.count; ++i) {
            load.work += h * contact.weight[at(i)] * contact.rubbed.dot(velocity_of(state, contact.vertex[at(i)]));
        }
    }
}

void ContactSolver::react(std::vector<Wrench>& reaction) {
    for (const Active& contact : active_) {
        const LinearContact& source = effect_->contacts[contact.source];
        ContactLoad& load = loads_[contact.source];
        load.friction = mean_friction_[contact.source].norm();
        load.force = mean_normal_[contact.source] + mean_friction_[contact.source];
        if (source.reaction_body < 0) continue;
        const Vector3 force = -load.force;
        Wrench& wrench = reaction[at(source.reaction_body)];
        wrench.force += force;
        wrench.moment += source.reaction_point.cross(force);
    }
}

}  // namespace trocar
