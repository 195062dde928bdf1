// Solution of a step of ImplicitSystem. Conjugate gradients and line searches minimise the convex function of the step,
// which contains the normal contact forces. Friction is an outer iteration.
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "tissue/implicit_system.hpp"

namespace trocar {

void ImplicitSystem::solve(bool known, int steps, const Accuracy& accuracy, TickContacts& contacts) {
    const double h = listed_for_;
    const std::span<TickContact> all = contacts.all();
    TissueState& state = tissue_->state();
    start_.clear();
    for (const Index local : contacts.touched()) start_.emplace_back(state.velocity.col(local).head<3>());
    take_laws(h, known, contacts);
    stand_still();
    residual_.leftCols(eigen_index(active_)) = whole_right_side_.leftCols(eigen_index(active_));
    acts_ = kernels_->improve(active_, 0.0, direction_.data(), image_.data(), inverse_.data(), change_.data(),
                              residual_.data(), preconditioned_.data());
    is_finite_ = std::isfinite(acts_);
    contacts.gather_anchor();
    for (std::size_t c = 0; c < all.size(); ++c) {
        all[c].rubbed.setZero();
        if (!all[c].has_friction || !(all[c].force > 0.0)) continue;
        const TickContacts::Anchor& anchor = contacts.anchor(contacts.given(all[c]).slip_key);
        if (anchor.most == 0.0 || anchor.strongest == c) stick(h, c, contacts);
    }
    const auto show_velocities = [&] {
        for (const Index local : contacts.touched()) {
            const Vector3 change = change_.col(number_[0][at(local)]).head<3>();
            state.velocity.col(local).head<3>() = start_[at(contacts.spot(local))] + change;
        }
    };
    constexpr int most_rounds = 20;
    constexpr double settled = 1e-4;  // of the largest force
    has_changed_ = false;
    first_ = 0.0;
    if (!known && vertices_.nodes > 0) begin_as_before(h, contacts);
    for (int round = 0; round < most_rounds; ++round) {
        take_rows(h, contacts);
        // The pressing contacts are found first among the vertices, where an iteration costs a third. Coarser nodes
        // hardly affect them, but must not have changed yet, because that search ignores them.
        const bool has_coarser = vertices_.nodes < everything_.nodes;
        if (round == 0 && vertices_.nodes > 0 && has_coarser) find_change(h, vertices_, accuracy, contacts);
        find_change(h, everything_, accuracy, contacts);
        show_velocities();
        double largest = 0.0;
        for (const TickContact& contact : all) largest = std::max(largest, std::abs(contact.force));
        if (!contacts.any_has_friction() || rub(h, contacts) <= settled * largest) break;
    }
    remember_forces(contacts);
    close_momentum();
    show_velocities();
    if (contacts.any_has_friction()) stretch_slips(h, contacts);
    if (contacts.has_solver()) {
        contacts.solve_impulses(h, steps, state);
        for (const Index local : contacts.touched()) {
            change_.col(number_[0][at(local)]).head<3>() =
                state.velocity.col(local).head<3>() - start_[at(contacts.spot(local))];
        }
    }
    for (const Index local : contacts.touched()) state.velocity.col(local).head<3>() = start_[at(contacts.spot(local))];
}

/// Initial guess of the velocity change. At slightly wrong velocities stiff contacts exert forces hundreds of times too
/// large, so the last velocities are unsuitable. The guess is one preconditioner step towards the rates at which the
/// contacts exert their last forces. It determines which contacts press.
void ImplicitSystem::begin_as_before(double h, TickContacts& contacts) {
    const std::span<const TickContact> all = contacts.all();
    const auto count = eigen_index(vertices_.nodes);
    residual_.leftCols(count).setZero();
    bool any = false;
    for (std::size_t c = 0; c < all.size(); ++c) {
        const std::uint64_t id = contacts.given(all[c]).source_id;
        Row& row = rows_[c];
        row.rate = std::numeric_limits<double>::infinity();
        if (row.yield == 0.0) continue;
        const Pressed* const before = pressed_before(id);
        if (before == nullptr) continue;
        any = true;
        row.rate = (row.given - before->force) / row.yield;
        push(all[c], h * row.yield * (row.rate - TickContacts::rate(all[c], tissue_->state())), residual_);
    }
    if (!any) return;
    take_blocks(h, contacts);
    precondition(0.0, vertices_, contacts);
    change_.leftCols(count) = preconditioned_.leftCols(count);
    first_ = acts_;
    has_changed_ = true;
}

const ImplicitSystem::Pressed* ImplicitSystem::pressed_before(std::uint64_t id) const {
    const auto place = std::lower_bound(pressed_.begin(), pressed_.end(), id,
                                        [](const Pressed& entry, std::uint64_t other) { return entry.id < other; });
    return place != pressed_.end() && place->id == id ? &*place : nullptr;
}

void ImplicitSystem::remember_forces(const TickContacts& contacts) {
    pressed_.clear();
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        const std::uint64_t id = contacts.given(contacts.all()[c]).source_id;
        if (id != 0 && rows_[c].yields()) pressed_.push_back({id, rows_[c].now});
    }
    std::sort(pressed_.begin(), pressed_.end(),
              [](const Pressed& a, const Pressed& b) { return std::tie(a.id, a.force) < std::tie(b.id, b.force); });
}

/// Sets the force of each contact as a bounded function of its rate after the step. The force falls with the rate, so
/// that the step is the unique minimum of a convex function.
void ImplicitSystem::take_laws(double h, bool known, TickContacts& contacts) {
    const TissueState& state = tissue_->state();
    rows_.assign(contacts.all().size(), {});
    std::size_t spanning = 0;
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        TickContact& contact = contacts.all()[c];
        Row& row = rows_[c];
        const double rate = TickContacts::rate(contact, state);
        const bool closed = contact.bilateral || contact.depth >= 0.0;
        row.most = contact.limit;
        row.least = !contact.pulls && !known ? 0.0 : -contact.limit;
        if (known) {
            row.given = contact.held;
        } else {
            // Explicit (negative) damping acts at the velocity at the start of the step.
            contact.held = closed ? -contact.explicit_damping * rate : 0.0;
            if (closed || !contact.pulls) {
                const StepLaw law = contact.law(h);
                row.given = law.still + contact.held;
                row.yield = law.slope;
            }
        }
        contact.force = row.force(rate);
        row.couples = contact.count > 1 && spanning++ < most_coupled;
    }
}

/// N s/m, force of the critically damped tangential spring per speed along the surface after the step.
double ImplicitSystem::tangent_slope(double h, const TickContact& contact, const TickContacts& contacts) {
    return contacts.tangent_damping(contact) + h * contacts.given(contact).tangent_k;
}

/// Makes a contact stick: its tangential spring acts along the surface.
void ImplicitSystem::stick(double h, std::size_t c, TickContacts& contacts) {
    const TickContact& contact = contacts.all()[c];
    const ContactForceLaw& source = contacts.given(contact);
    Row& row = rows_[c];
    row.has_friction = true;
    row.slide.setZero();
    row.slope = tangent_slope(h, contact, contacts);
    row.stretched = source.tangent_k * contact.along_surface(contacts.slip(source.slip_key));
}

/// Makes a contact slide with the force `most` (N) against `pull` (N), the force of its spring. The direction turns
/// with the velocity, as in the derivative of Coulomb's law.
void ImplicitSystem::slide(double h, std::size_t c, double most, const Vector3& pull, TickContacts& contacts) {
    stick(h, c, contacts);
    Row& row = rows_[c];
    const double wanted = pull.norm();
    row.slide = pull / wanted;
    row.slope *= most / wanted;
    row.stretched = most / wanted * row.held(row.stretched, contacts.all()[c]) + most * row.slide;
}

/// Right side with the tangential forces of contacts.
void ImplicitSystem::take_rows(double h, const TickContacts& contacts) {
    right_side_.leftCols(eigen_index(active_)) = whole_right_side_.leftCols(eigen_index(active_));
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        const TickContact& contact = contacts.all()[c];
        const Row& row = rows_[c];
        if (!row.has_friction) continue;
        Vector3 speed = -contact.surface;  // at the start of the step
        for (std::size_t i = 0; i < at(contact.count); ++i) {
            speed += contact.weight[i] * start_[at(contacts.spot(contact.vertex[i]))];
        }
        const Vector3 push = -row.stretched - row.slope * row.held(speed, contact);
        each_end(contact, [&](Eigen::Index n, double weight) { right_side_.col(n).head<3>() += h * weight * push; });
    }
}

/// Computes the preconditioner for the contacts that give way now.
void ImplicitSystem::take_blocks(double h, const TickContacts& contacts) {
    near_block_.clear();
    loose_inverse_.clear();
    for (const Index local : contacts.touched()) {
        near_block_.push_back(full(block_[at(number_[0][at(local)])]));
        loose_inverse_.emplace_back(near_block_.back().inverse());
    }
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        const TickContact& contact = contacts.all()[c];
        Row& row = rows_[c];
        row.square = 0.0;
        for (std::size_t i = 0; i < at(contact.count); ++i) {
            const Matrix3& inverse = loose_inverse_[at(contacts.spot(contact.vertex[i]))];
            const double impulse = h * contact.weight[i];
            row.square += impulse * impulse * contact.normal.dot(inverse * contact.normal);
        }
        row.press = row.pressing(h);
        const double rub = h * row.slope;  // kg
        if (row.press == 0.0 && rub == 0.0) continue;
        for (std::size_t i = 0; i < at(contact.count); ++i) {
            const double square = contact.weight[i] * contact.weight[i];
            Matrix3& block = near_block_[at(contacts.spot(contact.vertex[i]))];
            // Up to `most_coupled` contacts on several vertices are added by `couple`; all others go into the blocks.
            const double press = row.couples ? 0.0 : row.press;
            block += square * (press - rub) * contact.normal * contact.normal.transpose();
            block -= square * rub * row.slide * row.slide.transpose();
            block.diagonal().array() += square * rub;
        }
    }
    for (const Index local : contacts.touched()) {
        invert(at(number_[0][at(local)]), near_block_[at(contacts.spot(local))]);
    }
    couple(contacts);
}

/// Updates the preconditioner after one contact started or stopped giving way. Call `couple` after the last.
void ImplicitSystem::change_block(double h, std::size_t c, const TickContacts& contacts) {
    const TickContact& contact = contacts.all()[c];
    Row& row = rows_[c];
    const double before = row.press;
    row.press = row.pressing(h);
    if (row.couples) return;
    for (std::size_t i = 0; i < at(contact.count); ++i) {
        Matrix3& block = near_block_[at(contacts.spot(contact.vertex[i]))];
        const double square = contact.weight[i] * contact.weight[i];
        block += square * (row.press - before) * contact.normal * contact.normal.transpose();
        invert(at(number_[0][at(contact.vertex[i])]), block);
    }
}

/// Prepares the preconditioner (B + Jᵀ D J)⁻¹ by Woodbury's formula, with the blocks B and the coupled contacts J.
void ImplicitSystem::couple(const TickContacts& contacts) {
    coupled_.clear();
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        if (rows_[c].couples && rows_[c].press > 0.0) coupled_.push_back(c);
    }
    const auto count = eigen_index(coupled_.size());
    for (Eigen::Index a = 0; a < count; ++a) {
        const TickContact& one = contacts.all()[coupled_[static_cast<std::size_t>(a)]];
        for (Eigen::Index b = 0; b <= a; ++b) {
            const TickContact& other = contacts.all()[coupled_[static_cast<std::size_t>(b)]];
            double sum = a == b ? 1.0 / rows_[coupled_[static_cast<std::size_t>(a)]].press : 0.0;
            for (std::size_t i = 0; i < at(one.count); ++i) {
                for (std::size_t j = 0; j < at(other.count); ++j) {
                    if (one.vertex[i] != other.vertex[j]) continue;
                    const Eigen::Map<const Eigen::Matrix<double, 4, 3>> inverse(inverse_.data() +
                                                                                12 * at(number_[0][at(one.vertex[i])]));
                    sum += one.weight[i] * other.weight[j] * one.normal.dot((inverse * other.normal).head<3>());
                }
            }
            coupling_(a, b) = sum;
        }
    }
    Eigen::Ref<Eigen::MatrixXd> matrix = coupling_.topLeftCorner(count, count);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(matrix);
    if (factor.info() != Eigen::Success) coupled_.clear();
}

/// Steps along the direction by `by`, then preconditions the residual. Returns residual · preconditioned.
double ImplicitSystem::precondition(double by, const Part& part, const TickContacts& contacts) {
    const double product = kernels_->improve(part.nodes, by, direction_.data(), image_.data(), inverse_.data(),
                                             change_.data(), residual_.data(), preconditioned_.data());
    open_ = product;
    for (const Index local : contacts.touched()) {
        const auto n = eigen_index(at(number_[0][at(local)]));
        const Vector3 residual = residual_.col(n).head<3>();
        const Matrix3& loose = loose_inverse_[at(contacts.spot(local))];
        open_ += residual.dot(loose * residual - preconditioned_.col(n).head<3>());
    }
    const auto count = eigen_index(coupled_.size());
    if (count > 0) {
        auto push = coupled_push_.head(count);
        for (Eigen::Index a = 0; a < count; ++a) {
            const TickContact& contact = contacts.all()[coupled_[static_cast<std::size_t>(a)]];
            push[a] = along(contact, preconditioned_);
        }
        const auto factor = coupling_.topLeftCorner(count, count).triangularView<Eigen::Lower>();
        factor.solveInPlace(push);
        factor.transpose().solveInPlace(push);
        for (Eigen::Index a = 0; a < count; ++a) {
            const TickContact& contact = contacts.all()[coupled_[static_cast<std::size_t>(a)]];
            each_end(contact, [&](Eigen::Index n, double weight) {
                const Eigen::Map<const Eigen::Matrix<double, 4, 3>> inverse(inverse_.data() + 12 * n);
                preconditioned_.col(n).noalias() -= push[a] * weight * (inverse * contact.normal);
            });
        }
    }
    return count > 0 ? kernels_->dot(part.nodes, preconditioned_.data(), residual_.data()) : product;
}

/// True if the iterations may end. A stiff contact absorbs an impulse at a very small rate, so that `rho`, from blocks
/// with contacts, underestimates the residual. The residual is therefore measured by blocks without contacts and
/// compared with the contact forces. `rho` must fall as well, because it includes loads far from contacts.
bool ImplicitSystem::is_settled(double rho, double tolerance) const {
    double given = 0.0;
    for (const Row& row : rows_) given += row.now * row.now * row.square;
    const double square = tolerance * tolerance;
    constexpr double finely = 0.1 * 0.1;     // of the tolerance
    constexpr double roughly = 0.03 * 0.03;  // of the first residual
    if (open_ <= finely * square * (given + acts_)) return true;
    return open_ <= square * given && rho <= roughly * first_;
}

/// Step along the direction that minimises the convex function. Its slope is -`downhill` at 0 and rises by `curvature`,
/// and piecewise by the contacts that give way. Newton's method with a bracket.
double ImplicitSystem::step_length(double h, double downhill, double curvature) const {
    constexpr int most_steps = 60;
    constexpr double settled = 1e-12;
    double step = 0.0;
    double low = step;
    double high = std::numeric_limits<double>::infinity();
    for (int n = 0; n < most_steps; ++n) {
        double slope = step * curvature - downhill;
        double bend = curvature;
        for (const std::size_t c : moved_) {
            const Row& row = rows_[c];
            const double rate = row.rate + step * row.along;
            slope -= h * row.along * (row.force(rate) - row.now);
            if (row.yields(rate)) bend += h * row.yield * row.along * row.along;
        }
        if (n > 0 && std::abs(slope) <= settled * downhill) break;
        (slope < 0.0 ? low : high) = step;
        double next = step - slope / bend;
        if (!(next > low && next < high)) next = std::isfinite(high) ? 0.5 * (low + high) : 2.0 * step;
        if (next == step) break;
        step = next;
    }
    return step;
}

/// Clears the direction: it may not be finite, and nodes outside the next search must keep their change.
void ImplicitSystem::stand_still() {
    for (Matrix4X* vector : {&direction_, &image_}) vector->leftCols(eigen_index(nodes_.size())).setZero();
}

/// Minimises the convex function of the step, quadratic except for the limits of contacts. Newton's method: conjugate
/// gradients with a fixed set of contacts that give way, then a line search on the function, which prevents cycles.
/// Starts from the current change; nodes outside `part` keep theirs. Takes at least one iteration: a residual within
/// the tolerance that stayed in every step would add up.
void ImplicitSystem::find_change(double h, const Part& part, const Accuracy& accuracy, TickContacts& contacts) {
    take_residual(h, part, contacts);
    take_blocks(h, contacts);
    double rho = precondition(0.0, part, contacts);
    first_ = std::max(first_, rho);
    is_finite_ = is_finite_ && std::isfinite(rho);
    int iterations = accuracy.iterations;
    do {
        const Descent descent = descend(part, rho, {accuracy.tolerance, iterations}, contacts);
        iterations -= descent.iterations;
        if (!descent.strays) break;
        go_along(h, part, contacts);
        rho = precondition(0.0, part, contacts);
    } while (iterations > 0 && !is_settled(rho, accuracy.tolerance));
    for (std::size_t c = 0; c < rows_.size(); ++c) contacts.all()[c].force = rows_[c].now;
}

/// Residual and contact forces at the current change.
void ImplicitSystem::take_residual(double h, const Part& part, const TickContacts& contacts) {
    const auto count = eigen_index(part.nodes);
    const std::span<const TickContact> all = contacts.all();
    residual_.leftCols(count) = right_side_.leftCols(count);
    stand_still();
    if (has_changed_) {
        kernels_->turn(part.nodes, 0.0, change_.data(), inertia_.data(), direction_.data(), image_.data());
        multiply(part, contacts);
        residual_.leftCols(count) -= image_.leftCols(count);
    }
    has_changed_ = true;
    for (std::size_t c = 0; c < all.size(); ++c) {
        Row& row = rows_[c];
        row.rate = all[c].fixed_rate;
        for (std::size_t i = 0; i < at(all[c].count); ++i) {
            const Vector3 change = change_.col(number_[0][at(all[c].vertex[i])]).head<3>();
            const Vector3& start = start_[at(contacts.spot(all[c].vertex[i]))];
            row.rate += all[c].weight[i] * (start + change).dot(all[c].normal);
        }
        row.now = row.force(row.rate);
        if (row.now != 0.0) push(all[c], h * row.now, residual_);
    }
}

/// Conjugate gradients with a fixed set of pressing contacts, whose forces are not limited. Ends when the residual is
/// settled, or is reduced while a contact has left the set or should join it.
ImplicitSystem::Descent ImplicitSystem::descend(const Part& part, double rho, const Accuracy& accuracy,
                                                const TickContacts& contacts) {
    constexpr double enough = 0.3 * 0.3;
    const std::span<const TickContact> all = contacts.all();
    const auto turn = [&](double by) {
        kernels_->turn(part.nodes, by, preconditioned_.data(), inertia_.data(), direction_.data(), image_.data());
    };
    const auto count = eigen_index(part.nodes);
    start_change_.leftCols(count) = change_.leftCols(count);
    start_residual_.leftCols(count) = residual_.leftCols(count);
    for (Row& row : rows_) {
        row.start_rate = row.rate;
        row.start_force = row.now;
    }
    const double first = rho;
    turn(0.0);
    Descent descent;
    do {
        ++descent.iterations;
        multiply(part, contacts);
        for (std::size_t c = 0; c < all.size(); ++c) {
            Row& row = rows_[c];
            if (row.yield == 0.0) continue;
            row.along = along(all[c], direction_);
            if (row.press > 0.0) push(all[c], row.press * row.along, image_);
        }
        const double curvature = kernels_->dot(part.nodes, direction_.data(), image_.data());
        if (!(curvature > 0.0)) break;
        const double step = rho / curvature;
        descent.strays = false;
        for (Row& row : rows_) {
            if (row.yield == 0.0) continue;
            row.rate += step * row.along;
            if (row.press > 0.0) row.now = row.given - row.yield * row.rate;
            // A contact that jumps from zero to its limit gives way at neither.
            const bool goes = row.press > 0.0 ? !row.yields() : row.force(row.rate) != row.now;
            descent.strays = descent.strays || goes;
        }
        const double next = precondition(step, part, contacts);
        turn(next / rho);
        rho = next;
    } while (descent.iterations < accuracy.iterations && !is_settled(rho, accuracy.tolerance) &&
             !(descent.strays && rho <= enough * first));
    return descent;
}

/// Line search on the function along the result of `descend`.
void ImplicitSystem::go_along(double h, const Part& part, const TickContacts& contacts) {
    const std::span<const TickContact> all = contacts.all();
    const auto count = eigen_index(part.nodes);
    auto path = change_.leftCols(count);
    auto taken = residual_.leftCols(count);
    path -= start_change_.leftCols(count);
    taken = start_residual_.leftCols(count) - taken;
    const double downhill = kernels_->dot(part.nodes, start_residual_.data(), change_.data());
    double curvature = kernels_->dot(part.nodes, residual_.data(), change_.data());
    moved_.clear();
    for (std::size_t c = 0; c < all.size(); ++c) {
        Row& row = rows_[c];
        if (row.yield == 0.0) continue;
        row.along = row.rate - row.start_rate;
        row.rate = row.start_rate;
        row.now = row.start_force;
        curvature -= row.press * row.along * row.along;
        if (row.along != 0.0) moved_.push_back(c);
    }
    const double step = step_length(h, downhill, curvature);
    path = start_change_.leftCols(count) + step * path;
    taken = start_residual_.leftCols(count) - step * taken;
    for (const std::size_t c : moved_) {
        Row& row = rows_[c];
        row.rate += step * row.along;
        const double force = row.force(row.rate);
        push(all[c], h * (force - row.now) + step * row.press * row.along, residual_);
        row.now = force;
        if (row.yields() != (row.press > 0.0)) change_block(h, c, contacts);
    }
    couple(contacts);
}

/// Corrects the momentum of free pieces for the residual of the iterations. Skips pieces with a vertex held for the
/// tick.
void ImplicitSystem::close_momentum() {
    if (piece_inertia_.empty()) return;
    left_.setZero();
    std::fill(piece_inertia_.begin(), piece_inertia_.end(), 0.0);
    const auto each = [&](const auto& act) {
        for (std::size_t n = 0; n < active_; ++n) {
            const Index piece = (*levels_)[nodes_[n].level].piece[at(nodes_[n].node)];
            if (piece >= 0) act(eigen_index(n), piece);
        }
    };
    each([&](Eigen::Index n, Index piece) {
        const Node& node = nodes_[static_cast<std::size_t>(n)];
        const bool held = node.level == 0 && !tissue_->state().moves(node.node);
        left_.col(piece) += residual_.col(n).head<3>();
        piece_inertia_[at(piece)] +=
            held ? std::numeric_limits<double>::infinity() : inertia_[static_cast<std::size_t>(n)];
    });
    each(
        [&](Eigen::Index n, Index piece) { change_.col(n).head<3>() += left_.col(piece) / piece_inertia_[at(piece)]; });
}

/// Evaluates the friction of each contact at the new velocities and linearises its law there. Returns the largest
/// deviation of the previous laws from Coulomb's, N.
double ImplicitSystem::rub(double h, TickContacts& contacts) {
    contacts.gather_anchor(true);
    const std::span<TickContact> all = contacts.all();
    const TissueState& state = tissue_->state();
    double off = 0.0;
    for (std::size_t c = 0; c < all.size(); ++c) {
        TickContact& contact = all[c];
        if (!contact.has_friction) continue;
        Row& row = rows_[c];
        const bool anchors = contacts.anchors(c);
        if (!anchors && !row.has_friction) continue;
        const ContactForceLaw& source = contacts.given(contact);
        const double most = anchors ? contacts.anchor(source.slip_key).most : 0.0;
        const Vector3 speed = contact.along_surface(TickContacts::speed(contact, state));
        contact.rubbed = -row.stretched - row.slope * row.held(speed, contact);
        const Vector3 pull = source.tangent_k * contact.along_surface(contacts.slip(source.slip_key)) +
                             tangent_slope(h, contact, contacts) * speed;
        const double wanted = pull.norm();
        const double part = wanted > most ? most / wanted : 1.0;
        off = std::max(off, (part * pull + contact.rubbed).norm());
        if (!anchors) {
            row.stop_rubbing();
        } else if (part == 1.0 || pull.dot(row.slide) < 0.0) {
            // A contact whose pull has reversed sticks: sliding the other way would accelerate it.
            stick(h, c, contacts);
        } else {
            slide(h, c, most, pull, contacts);
        }
        if (contact.rubbed.norm() > most) contact.rubbed *= most / contact.rubbed.norm();
    }
    return off;
}

/// Updates the stretch of the tangential springs after the last `rub`, see TickContacts::stretch.
void ImplicitSystem::stretch_slips(double h, TickContacts& contacts) {
    const TissueState& state = tissue_->state();
    for (std::size_t c = 0; c < contacts.all().size(); ++c) {
        TickContact& contact = contacts.all()[c];
        if (!contact.has_friction || !contacts.anchors(c)) continue;
        const double most = contacts.anchor(contacts.given(contact).slip_key).most;
        if (contact.rubbed.norm() > most) contact.rubbed *= most / contact.rubbed.norm();
        contacts.stretch(c, h * TickContacts::speed(contact, state));
    }
}

double ImplicitSystem::move() {
    const double h = listed_for_;
    TissueState& state = tissue_->state();
    std::vector<NodeLevel>& levels = *levels_;
    double furthest = 0.0;
    bool finite = is_finite_;
    for (std::size_t n = 0; n < active_; ++n) {
        const Index node = nodes_[n].node;
        NodeLevel& here = levels[nodes_[n].level];
        const bool vertex = nodes_[n].level == 0;
        if (vertex && !state.moves(node)) continue;
        Matrix4X& velocity = vertex ? state.velocity : here.velocity;
        Matrix4X& place = vertex ? state.position : here.displacement;
        velocity.col(node) += change_.col(eigen_index(n));
        const Eigen::Vector4d path = h * velocity.col(node);
        place.col(node) += path;
        furthest = std::max(furthest, path.cwiseAbs().maxCoeff());
        finite = finite && path.allFinite();
    }
    return finite ? furthest : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace trocar
