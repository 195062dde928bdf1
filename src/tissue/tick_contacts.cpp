#include "tissue/tick_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact/contact.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

int count_of(const std::array<Index, 3>& vertices) {
    return static_cast<int>(std::count_if(vertices.begin(), vertices.end(), [](Index v) { return v >= 0; }));
}

/// Parameters in [0, 1] of the closest points of two lines, clamped to the edges.
std::pair<double, double> closest_on_edges(const Vector3& a0, const Vector3& along_a, const Vector3& b0,
                                           const Vector3& along_b) {
    const Vector3 across = along_a.cross(along_b);
    const double square = across.squaredNorm();
    const Vector3 between = b0 - a0;
    return {std::clamp(between.cross(along_b).dot(across) / square, 0.0, 1.0),
            std::clamp(between.cross(along_a).dot(across) / square, 0.0, 1.0)};
}

/// Weights of a face at its point closest to `point`. If `given` has a negative weight, the contact is with the face's
/// plane and the projection on that plane is used.
Vector3 under_point(const std::array<double, 3>& given, const Corners& face, const Vector3& point) {
    const bool beside = *std::min_element(given.begin(), given.end()) < 0.0;
    return beside ? projection_on_plane(face, point) : closest_point_on_triangle(face, point);
}

}  // namespace

TickContacts::TickContacts(Index vertex_count, std::size_t moving) {
    slip_.setZero(3, vertex_count);
    rubbed_.assign(at(vertex_count), 0);
    anchor_.assign(at(vertex_count), {});
    rubbing_.reserve(at(vertex_count));
    spot_.assign(at(vertex_count), -1);
    touched_.reserve(moving);
    // Reserves capacity, so that usual contact counts do not allocate within a tick.
    const std::size_t usual = std::min<std::size_t>(moving, 1024);
    contacts_.reserve(usual);
    mean_normal_.reserve(usual);
    mean_friction_.reserve(usual);
    velocity_before_.reserve(moving);
    contact_forces_.reserve(usual);
    predicted_.reserve(usual, moving);
}

void TickContacts::collect(const ResponseOutput& output, const Frame& frame, const TissueState& state,
                           std::span<const Vector3> late) {
    output_ = &output;
    for (const Index v : touched_) spot_[at(v)] = -1;
    touched_.clear();
    contacts_.clear();
    elapsed_ = 0.0;
    shifts_ = false;
    mean_normal_.assign(output.contacts.size(), Vector3::Zero());
    contact_forces_.assign(output.contacts.size(), {});
    mean_friction_.assign(output.contacts.size(), Vector3::Zero());
    // A contact that was absent from the last tick's effect starts with an unstretched tangential spring.
    std::erase_if(rubbing_, [this](Index v) { return --rubbed_[at(v)] == 0; });
    for (const Index key : rubbing_) anchor_[at(key)] = {};
    for (std::size_t c = 0; c < output.contacts.size(); ++c) {
        TickContact entry;
        entry.source = c;
        if (!enter(output.contacts[c], frame, state, late, entry)) continue;
        remember_slip(output.contacts[c], entry);
        contact_forces_[c].work = 0.0;
        const auto touch = [this](Index local) {
            if (spot_[at(local)] >= 0) return;
            spot_[at(local)] = static_cast<Index>(touched_.size());
            touched_.push_back(local);
        };
        for (int i = 0; i < entry.count; ++i) touch(entry.vertex[at(i)]);
        if (entry.turns) {
            // A corner of weight 0 may get weight within the tick.
            for (const auto& vertices : {output.contacts[c].vertices, output.contacts[c].reaction_vertices}) {
                for (const Index vertex : vertices) {
                    if (vertex >= 0 && state.moves(state.place[at(vertex)])) touch(state.place[at(vertex)]);
                }
            }
        }
        contacts_.push_back(entry);
    }
}

/// False if no vertex of the contact is free.
bool TickContacts::enter(const ContactForceLaw& contact, const Frame& frame, const TissueState& state,
                         std::span<const Vector3> late, TickContact& entry) {
    entry.normal = contact.normal;
    entry.depth = -contact.gap;
    entry.stiffness = contact.k;
    entry.damping = std::max(contact.mu, 0.0);
    entry.explicit_damping = std::min(contact.mu, 0.0);
    entry.bilateral = contact.bilateral();
    entry.pulls = contact.pulls();
    entry.limit = contact.limit;
    double speed = 0.0;  // of P, in the frame
    const auto add = [&](Index vertex, double weight) {
        if (vertex < 0 || weight == 0.0) return;
        const Index local = state.place[at(vertex)];
        if (local >= 0 && state.moves(local)) {
            entry.vertex[at(entry.count)] = local;
            entry.weight[at(entry.count)] = weight;
            entry.mobility += weight * weight * state.inverse_mass[at(local)];
            ++entry.count;
            speed += weight * frame.velocity.col(vertex).dot(contact.normal);
            if (!late.empty()) entry.depth -= weight * late[at(local)].dot(contact.normal);
        } else {
            const Vector3 velocity = local >= 0 ? Vector3(velocity_of(state, local)) : frame.velocity.col(vertex);
            entry.fixed_rate += weight * velocity.dot(contact.normal);
            entry.surface -= weight * velocity;
        }
    };
    for (std::size_t i = 0; i < 3; ++i) add(contact.vertices[i], contact.weights[i]);
    if (any_vertex(contact.reaction_vertices) >= 0) {
        for (std::size_t i = 0; i < 3; ++i) add(contact.reaction_vertices[i], -contact.reaction_weights[i]);
    } else {
        entry.fixed_rate -= contact.face_velocity;
        entry.surface += contact.surface_velocity;
    }
    if (entry.count == 0) return false;
    if (contact.role == ContactRole::solved && output_->solver != nullptr) {
        const auto heavy = [](double weight) { return std::abs(weight) >= least_weight; };
        entry.solved = std::any_of(entry.weight.begin(), entry.weight.begin() + entry.count, heavy);
    }
    // Only constraints with a source_id have other_point, the other side at the start of the tick. Static tissue is not
    // in the state and has no motion to follow.
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
    if (!entry.pulls) entry.held = std::max(entry.held, 0.0);
    if (!entry.bilateral && entry.depth < 0.0) entry.held = 0.0;
    entry.held = entry.within_limit(entry.held);
    return true;
}

void TickContacts::remember_slip(const ContactForceLaw& contact, TickContact& entry) {
    const Index key = contact.slip_key;
    if (contact.friction <= 0.0 || key < 0) return;
    entry.has_friction = true;
    if (at(key) >= rubbed_.size()) {
        const auto known = static_cast<Eigen::Index>(rubbed_.size());
        slip_.conservativeResize(3, key + 1);
        slip_.rightCols(key + 1 - known).setZero();
        rubbed_.resize(at(key) + 1, 0);
        anchor_.resize(at(key) + 1);
    }
    if (rubbed_[at(key)] == 0) {
        slip_.col(key).setZero();
        rubbing_.push_back(key);
    }
    rubbed_[at(key)] = 2;
}

double TickContacts::rate(const TickContact& contact, const TissueState& state) {
    double sum = contact.fixed_rate;
    for (int i = 0; i < contact.count; ++i) {
        sum += contact.weight[at(i)] * velocity_of(state, contact.vertex[at(i)]).dot(contact.normal);
    }
    return sum;
}

void TickContacts::begin_substep(const TissueState& state) {
    velocity_before_.clear();
    for (std::size_t t = 0; has_solver() && t < touched_.size(); ++t) {
        velocity_before_.emplace_back(velocity_of(state, touched_[t]));
    }
    for (TickContact& contact : contacts_) {
        if (contact.solved) contact.rubbed.setZero();
    }
    switch (output_->contact_timing) {
        case ContactTiming::at_substep_start:
            return hold_current_force(state);
        case ContactTiming::implicit:
            return turn(state);
        case ContactTiming::at_tick_start:
            return;
    }
}

void TickContacts::hold_current_force(const TissueState& state) {
    for (TickContact& contact : contacts_) {
        const double speed = rate(contact, state);
        double force = contact.stiffness * contact.depth - (contact.damping + contact.explicit_damping) * speed;
        if (!contact.bilateral && (contact.depth < 0.0 || (!contact.pulls && force < 0.0))) force = 0.0;
        contact.held = contact.within_limit(force);
    }
}

void TickContacts::turn(const TissueState& state) {
    for (TickContact& contact : contacts_) {
        if (!contact.turns) continue;
        const ContactForceLaw& given = output_->contacts[contact.source];
        if (any_vertex(given.reaction_vertices) >= 0) {
            turn_tissues(state, contact);
            continue;
        }
        const auto corner = [&](std::size_t i) -> Vector3 {
            return state.position.col(state.place[at(given.vertices[i])]).head<3>();
        };
        const Vector3 point = given.other_point + elapsed_ * given.surface_velocity;
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
            // Projects along the other edge into one plane.
            const auto flat = [&edge](const Vector3& v) { return Vector3(v - v.dot(edge) * edge); };
            const Vector3 along = flat(second - first);
            const double path = std::clamp(flat(point - first).dot(along) / along.squaredNorm(), 0.0, 1.0);
            weights = {1.0 - path, path, 0.0};
        } else {
            weights = under_point(given.weights, {first, second, third}, point);
        }
        take_weights(state, weights, Vector3::Zero(), normal, contact);
    }
}

/// Contact of two tissues, vertex and face or two edges: both sides are at their positions after the last sub-step.
void TickContacts::turn_tissues(const TissueState& state, TickContact& contact) const {
    const ContactForceLaw& given = output_->contacts[contact.source];
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
        const auto [path, other_direction] = closest_on_edges(pushed.col(0), along, other.col(0), other_along);
        weights = {1.0 - path, path, 0.0};
        other_weights = {1.0 - other_direction, other_direction, 0.0};
    } else {
        const bool is_face = count_of(given.vertices) == 3;
        const Matrix3& face = is_face ? pushed : other;
        normal = (face.col(1) - face.col(0)).cross(face.col(2) - face.col(0));
        (is_face ? weights : other_weights) =
            under_point(is_face ? given.weights : given.reaction_weights, {face.col(0), face.col(1), face.col(2)},
                        is_face ? other.col(0) : pushed.col(0));
    }
    const double size = normal.norm();
    if (size == 0.0) return;
    normal /= normal.dot(contact.normal) < 0.0 ? -size : size;
    take_weights(state, weights, other_weights, normal, contact);
}

/// Changes nothing if no weight is on a free vertex. `other_weights` are used where the other side is tissue.
void TickContacts::take_weights(const TissueState& state, const Vector3& weights, const Vector3& other_weights,
                                const Vector3& normal, TickContact& contact) const {
    const ContactForceLaw& given = output_->contacts[contact.source];
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
    contact.surface = any_vertex(given.reaction_vertices) < 0 ? given.surface_velocity : Vector3(Vector3::Zero());
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

Vector3 TickContacts::speed(const TickContact& contact, const TissueState& state) {
    Vector3 sum = -contact.surface;
    for (int i = 0; i < contact.count; ++i) sum += contact.weight[at(i)] * velocity_of(state, contact.vertex[at(i)]);
    return sum;
}

void TickContacts::gather_anchor(bool keep) {
    for (const Index key : rubbing_) {
        Anchor& anchor = anchor_[at(key)];
        const auto presses = [&](const TickContact& strongest) {
            return strongest.has_friction && strongest.force > 0.0 && given(strongest).slip_key == key;
        };
        const bool stays = keep && anchor.most > 0.0 && presses(contacts_[anchor.strongest]);
        anchor = {.most = 0.0, .strongest = stays ? anchor.strongest : 0, .stays = stays};
    }
    for (std::size_t a = 0; a < contacts_.size(); ++a) {
        const TickContact& contact = contacts_[a];
        if (!contact.has_friction || contact.force <= 0.0) continue;
        const ContactForceLaw& source = output_->contacts[contact.source];
        Anchor& anchor = anchor_[at(source.slip_key)];
        const bool is_firmer = anchor.most == 0.0 || contact.force > contacts_[anchor.strongest].force;
        if (!anchor.stays && is_firmer) anchor.strongest = a;
        anchor.most += source.friction * contact.force;
    }
}

bool TickContacts::anchors(std::size_t number) {
    const Index key = output_->contacts[contacts_[number].source].slip_key;
    const Anchor& anchor = anchor_[at(key)];
    if (anchor.most <= 0.0) slip_.col(key).setZero();
    return anchor.most > 0.0 && anchor.strongest == number;
}

void TickContacts::rub(std::size_t number, double h, const Vector3& speed) {
    TickContact& contact = contacts_[number];
    const ContactForceLaw& source = output_->contacts[contact.source];
    const double most = anchor_[at(source.slip_key)].most;
    const Vector3 flat = contact.along_surface(speed);
    const Vector3 stretch = contact.along_surface(slip_.col(source.slip_key));
    const double damping = tangent_damping(contact);
    const Vector3 sticking = -(source.tangent_k * (stretch + h * flat) + damping * flat) /
                             (1.0 + h * contact.mobility * (damping + h * source.tangent_k));
    const double wanted = sticking.norm();
    if (wanted > most) {
        contact.rubbed = most / wanted * sticking;
        slide(number);
    } else {
        contact.rubbed = sticking;
        slip_.col(source.slip_key) = stretch + h * (flat + h * contact.mobility * contact.rubbed);
    }
}

void TickContacts::stretch(std::size_t number, const Vector3& path) {
    const TickContact& contact = contacts_[number];
    const Index key = output_->contacts[contact.source].slip_key;
    constexpr double rounding = 1e-9;
    if (contact.rubbed.norm() >= anchor_[at(key)].most * (1.0 - rounding)) {
        slide(number);
        return;
    }
    slip_.col(key) = contact.along_surface(slip_.col(key) + path);
}

void TickContacts::slide(std::size_t number) {
    const TickContact& contact = contacts_[number];
    const ContactForceLaw& source = output_->contacts[contact.source];
    auto slip = slip_.col(source.slip_key);
    if (source.tangent_k > 0.0) {
        slip = -contact.rubbed / source.tangent_k;
    } else {
        slip.setZero();
    }
}

/// SolverTiming::held applies the impulses over the whole tick, so velocity changes of this sub-step are extrapolated
/// over the remaining sub-steps.
void TickContacts::predict(double h, int substeps, const TissueState& state) {
    const SolverTiming timing = output_->solver_timing;
    predicted_.begin(timing == SolverTiming::substep ? h : h * substeps);
    const double further = timing == SolverTiming::held ? substeps - 1.0 : 0.0;
    for (std::size_t t = 0; t < touched_.size(); ++t) {
        const Vector3 now = velocity_of(state, touched_[t]);
        predicted_.add_column(now + further * (now - velocity_before_[t]), state.inverse_mass[at(touched_[t])]);
    }
    for (const TickContact& contact : contacts_) {
        if (!contact.solved) continue;
        SolvedContact entry{.source = contact.source,
                            .normal = contact.normal,
                            .depth = contact.depth,
                            .count = contact.count,
                            .weight = contact.weight,
                            .surface = contact.surface,
                            .mobility = contact.mobility};
        for (int i = 0; i < contact.count; ++i) entry.column[at(i)] = spot(contact.vertex[at(i)]);
        predicted_.add(entry);
    }
}

void TickContacts::solve_impulses(double h, int substeps, TissueState& state) {
    if (!has_solver()) return;
    const SolverTiming timing = output_->solver_timing;
    const bool asks = timing == SolverTiming::substep || elapsed_ == 0.0;
    if (asks) {
        predict(h, substeps, state);
        try {
            output_->solver->solve(predicted_);
        } catch (const std::exception& error) {
            throw std::runtime_error(std::string("the response's solver: ") + error.what());
        }
    }
    shifts_ = asks;
    const double part = timing == SolverTiming::held ? 1.0 / substeps : 1.0;
    std::size_t number = 0;
    for (TickContact& contact : contacts_) {
        if (!contact.solved) continue;
        const Vector3 impulse = part * predicted_.impulse(number++);
        contact.force = impulse.dot(contact.normal) / h;
        contact.rubbed = contact.along_surface(impulse) / h;
        for (int i = 0; i < contact.count; ++i) {
            const Index local = contact.vertex[at(i)];
            velocity_of(state, local) += contact.weight[at(i)] * state.inverse_mass[at(local)] * impulse;
        }
    }
}

double TickContacts::shift(MovingTissue& tissue) {
    double furthest = 0.0;
    for (std::size_t t = 0; shifts_ && t < touched_.size(); ++t) {
        const Vector3& by = predicted_.shift(static_cast<Index>(t));
        if (by.isZero(0.0)) continue;
        contact_forces_[predicted_.shifted_by(static_cast<Index>(t)).source].work += tissue.put_aside(touched_[t], by);
        furthest = std::max(furthest, by.cwiseAbs().maxCoeff());
    }
    return furthest;
}

/// m, of the contact point P.
Vector3 TickContacts::shift_of(const TickContact& contact) const {
    Vector3 sum = Vector3::Zero();
    for (int i = 0; shifts_ && i < contact.count; ++i) {
        sum += contact.weight[at(i)] * predicted_.shift(spot(contact.vertex[at(i)]));
    }
    return sum;
}

void TickContacts::finish_substep(double h, int substeps, const TissueState& state) {
    elapsed_ += h;
    for (TickContact& contact : contacts_) {
        const double speed = rate(contact, state);
        contact.depth -= h * speed + shift_of(contact).dot(contact.normal);
        ContactForce& load = contact_forces_[contact.source];
        if (contact.solved) {
            // Work of an impulse: impulse times the mean of the velocities before and after.
            const Vector3 force = contact.force * contact.normal + contact.rubbed;
            for (int i = 0; i < contact.count; ++i) {
                const Index local = contact.vertex[at(i)];
                const Vector3 both = velocity_before_[at(spot(local))] + velocity_of(state, local);
                load.work += 0.5 * h * contact.weight[at(i)] * force.dot(both);
            }
            mean_friction_[contact.source] += contact.rubbed / substeps;
        } else {
            load.work += h * contact.force * (speed - contact.fixed_rate);
        }
        load.normal += contact.force / substeps;
        mean_normal_[contact.source] += contact.force / substeps * contact.normal;
        load.at_limit = std::abs(contact.force) >= contact.limit;
        if (!contact.has_friction) continue;
        mean_friction_[contact.source] += contact.rubbed / substeps;
        load.slip += slip_.col(output_->contacts[contact.source].slip_key).norm() / substeps;
        for (int i = 0; i < contact.count; ++i) {
            load.work += h * contact.weight[at(i)] * contact.rubbed.dot(velocity_of(state, contact.vertex[at(i)]));
        }
    }
}

void TickContacts::react(std::vector<Wrench>& reaction) {
    for (const TickContact& contact : contacts_) {
        const ContactForceLaw& source = output_->contacts[contact.source];
        ContactForce& load = contact_forces_[contact.source];
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
