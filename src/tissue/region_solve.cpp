// How RegionSystem finds a step's velocities: conjugate gradients with the contacts that press and stick in the matrix,
// within the search for which those are.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tissue/active_set.hpp"
#include "tissue/region_system.hpp"

namespace trocar {
namespace {

bool is_free(const TickContact& contact) { return !contact.bilateral && !contact.adhesive; }

Vector3 along_surface(const Vector3& vector, const TickContact& contact) {
    return vector - vector.dot(contact.normal) * contact.normal;
}

/// m/s, of P against the other side, with `velocity_of(end)` of its vertices.
template <typename VelocityOf>
Vector3 speed_of(const TickContact& contact, const VelocityOf& velocity_of) {
    Vector3 speed = -contact.surface;
    for (std::size_t i = 0; i < at(contact.count); ++i) speed += contact.weight[i] * velocity_of(contact.vertex[i]);
    return speed;
}

}  // namespace

void RegionSystem::solve(double h, bool known, double tolerance, int iterations, TickContacts& contacts) {
    const std::span<TickContact> all = contacts.all();
    TissueState& state = tissue_->state();
    rows_.assign(all.size(), {});
    start_.clear();
    for (const Index local : contacts.touched()) start_.emplace_back(state.velocity.col(local).head<3>());
    for (TickContact& contact : all) {
        // Also what the speeds as they are bring together: fewer guesses than from the depth alone.
        contact.on = contact.bilateral || contact.depth >= std::min(0.0, h * TickContacts::rate(contact, state));
        contact.capped = false;
        // Negative damping from the velocity at the start of the step.
        if (!known) contact.held = contact.on ? -contact.explicit_damping * TickContacts::rate(contact, state) : 0.0;
        contact.force = known ? contact.held : 0.0;
        contact.rubbed.setZero();
    }
    for (std::size_t c = 0; c < all.size(); ++c) {
        if (all[c].rubs && (known ? all[c].force > 0.0 : all[c].on)) hold_along(h, c, 1.0, contacts);
    }
    const auto show_velocities = [&] {
        for (const Index local : contacts.touched()) {
            const Vector3 change = change_.col(number_[0][at(local)]).head<3>();
            state.velocity.col(local).head<3>() = start_[at(contacts.spot(local))] + change;
        }
    };
    const auto solved = [&](double within) {
        take_rows(h, known, contacts);
        const bool finite = find_change(tolerance, within, iterations, contacts);
        show_velocities();
        return finite;
    };
    constexpr int most_rounds = 20;
    constexpr double settled = 1e-4;  // of the largest force
    for (int round = 0; round < most_rounds; ++round) {
        if (known || all.empty()) {
            solved(0.0);
        } else {
            find_pressing(h, all, solved);
        }
        double largest = 0.0;
        for (const TickContact& contact : all) largest = std::max(largest, std::abs(contact.force));
        if (!contacts.any_rubs() || rub(h, contacts) <= settled * largest) break;
    }
    reference_ = 0.0;
    for (const TickContact& contact : all) {
        each_end(contact, [&](Eigen::Index n, double weight) {
            const Vector3 impulse = h * weight * (contact.force * contact.normal + contact.rubbed);
            const Eigen::Map<const Eigen::Matrix<double, 4, 3>> inverse(inverse_.data() + 12 * n);
            reference_ += impulse.dot((inverse * impulse).head<3>());
        });
    }
    close_momentum();
    show_velocities();
    if (contacts.any_rubs()) stretch_slips(h, contacts);
    for (const Index local : contacts.touched()) state.velocity.col(local).head<3>() = start_[at(contacts.spot(local))];
}

/// A guess needs no more of a solution than to be told from the next one: what presses is found on rough ones first, in
/// a few rounds (on rough solutions contacts may go round in circles that exact ones do not know), then confirmed or
/// mended on exact ones. Many contacts that share few vertices may go round in circles there, too. Then those that go
/// deepest press first, few at a time; and if none settles, those that would pull leave, one round after the other, and
/// none joins.
template <typename Solved>
void RegionSystem::find_pressing(double h, std::span<TickContact> contacts, const Solved& solved) {
    struct Rough {
        double within;  // of the residual that a guess begins with
        int rounds;
    };
    constexpr std::array<Rough, 2> rough{{{0.1, 8}, {0.01, 8}}};
    const TissueState& state = tissue_->state();
    const auto rate_of = [&state](const TickContact& contact) { return TickContacts::rate(contact, state); };
    constexpr int many = 60;
    const auto settle = [&](double within, int most_changes) {
        return find_active(
            contacts, h, [&] { return solved(within); }, rate_of, most_changes);
    };
    for (const auto& [within, rounds] : rough) {
        if (settle(within, rounds)) break;
    }
    if (settle(0.0, many)) return;
    press_deepest_first(h, contacts, [&] { return solved(rough.back().within); });
    if (settle(0.0, many)) return;
    for (bool settled = false; !settled;) {
        solved(0.0);
        settled = true;
        for (TickContact& contact : contacts) {
            if (contact.capped) continue;
            const double force = force_of(contact, h, rate_of(contact));
            contact.force = contact.on ? contact.within_limit(force) : 0.0;
            if (!contact.on || !is_free(contact) || force >= 0.0) continue;
            contact.on = false;
            contact.force = 0.0;
            settled = false;
        }
    }
}

template <typename Solved>
void RegionSystem::press_deepest_first(double h, std::span<TickContact> contacts, const Solved& solved) {
    const TissueState& state = tissue_->state();
    const auto rate_of = [&state](const TickContact& contact) { return TickContacts::rate(contact, state); };
    const auto pulls = [&](const TickContact& contact) {
        return contact.on && is_free(contact) && force_of(contact, h, rate_of(contact)) < 0.0;
    };
    constexpr std::size_t at_once = 4;
    for (TickContact& contact : contacts) {
        contact.capped = false;
        if (is_free(contact)) contact.on = false;
    }
    for (std::size_t joined = 0; joined < contacts.size(); joined += at_once) {
        solved();
        for (TickContact& contact : contacts) {
            if (pulls(contact)) contact.on = false;
        }
        bool deepens = false;
        for (std::size_t n = 0; n < at_once; ++n) {
            TickContact* deepest = nullptr;
            double depth = 0.0;
            for (TickContact& contact : contacts) {
                const double after = contact.depth - h * rate_of(contact);
                if (contact.on || !is_free(contact) || after <= depth) continue;
                deepest = &contact;
                depth = after;
            }
            if (deepest == nullptr) break;
            deepest->on = true;
            deepens = true;
        }
        if (!deepens) break;
    }
}

/// A contact holds what it touches along the surface by a spring with a critical damper; `part` of both where it
/// slides, the one that pulls as much as friction allows.
void RegionSystem::hold_along(double h, std::size_t c, double part, TickContacts& contacts) {
    const TickContact& contact = contacts.all()[c];
    const LinearContact& source = contacts.given(contact);
    Row& row = rows_[c];
    const double damping = 2.0 * std::sqrt(source.tangent_k / contact.mobility);
    row.slope = part * (damping + h * source.tangent_k);
    row.rub = h * row.slope;
    row.part = part;
    row.stretched = part * source.tangent_k * along_surface(contacts.slip(source.slip_key), contact);
}

/// What the contacts as they are on, at their limit and sticking put into the matrix and the right side.
void RegionSystem::take_rows(double h, bool known, TickContacts& contacts) {
    const std::span<TickContact> all = contacts.all();
    right_side_.leftCols(eigen_index(awake_)) = whole_right_side_.leftCols(eigen_index(awake_));
    near_block_.clear();
    for (const Index local : contacts.touched()) near_block_.push_back(block_[at(number_[0][at(local)])]);
    for (std::size_t c = 0; c < all.size(); ++c) {
        const TickContact& contact = all[c];
        Row& row = rows_[c];
        const double damping = contact.damping + h * contact.stiffness;
        const bool presses = !known && contact.on && !contact.capped;
        row.press = presses ? h * damping : 0.0;
        const Vector3 speed =
            speed_of(contact, [&](Index local) -> const Vector3& { return start_[at(contacts.spot(local))]; });
        const double rate = speed.dot(contact.normal) + contact.surface.dot(contact.normal) + contact.fixed_rate;
        double given = contact.capped || known ? contact.force : 0.0;
        if (presses) given = contact.stiffness * contact.depth + contact.held - damping * rate;
        Vector3 push = given * contact.normal;
        if (row.part > 0.0) push -= row.stretched + row.slope * along_surface(speed, contact);
        for (std::size_t i = 0; i < at(contact.count); ++i) {
            const Index local = contact.vertex[i];
            const double weight = contact.weight[i];
            right_side_.col(number_[0][at(local)]).head<3>() += h * weight * push;
            Matrix3& block = near_block_[at(contacts.spot(local))];
            // What presses on one vertex is in its block; what spans several is put right after the blocks.
            const double press = contact.count == 1 ? row.press : 0.0;
            block += weight * weight * (press - row.rub) * contact.normal * contact.normal.transpose();
            block.diagonal().array() += weight * weight * row.rub;
        }
    }
    for (const Index local : contacts.touched()) {
        invert(at(number_[0][at(local)]), near_block_[at(contacts.spot(local))]);
    }
    couple(contacts);
}

/// For the preconditioner: (B + Jᵀ D J)⁻¹ with the blocks B and the contacts J that press on several vertices, by
/// Woodbury's formula.
void RegionSystem::couple(const TickContacts& contacts) {
    coupled_.clear();
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        if (contacts.all()[c].count > 1 && rows_[c].press > 0.0) coupled_.push_back(c);
    }
    if (coupled_.size() > at(static_cast<Index>(coupling_.rows()))) coupled_.clear();
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

/// A step of that length along the direction; then the residual preconditioned. Gives their product.
double RegionSystem::precondition(double by, const TickContacts& contacts) {
    const double product = kernels_->improve(awake_, by, direction_.data(), image_.data(), inverse_.data(),
                                             change_.data(), residual_.data(), preconditioned_.data());
    const auto count = eigen_index(coupled_.size());
    if (count > 0) {
        auto push = coupled_push_.head(count);
        for (Eigen::Index a = 0; a < count; ++a) {
            const TickContact& contact = contacts.all()[coupled_[static_cast<std::size_t>(a)]];
            double rate = 0.0;
            each_end(contact, [&](Eigen::Index n, double weight) {
                rate += weight * preconditioned_.col(n).head<3>().dot(contact.normal);
            });
            push[a] = rate;
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
    return count > 0 ? kernels_->dot(awake_, preconditioned_.data(), residual_.data()) : product;
}

/// Preconditioned conjugate gradients from the change as it is, until the residual is below the tolerance or `within`
/// of what it begins with. False where the numbers are not finite.
bool RegionSystem::find_change(double tolerance, double within, int iterations, const TickContacts& contacts) {
    const auto count = eigen_index(awake_);
    const auto turn_from = [&](const Matrix4X& to, double by) {
        kernels_->turn(awake_, by, to.data(), inertia_.data(), direction_.data(), image_.data());
    };
    residual_.leftCols(count) = right_side_.leftCols(count);
    for (Matrix4X* vector : {&direction_, &image_}) vector->leftCols(count).setZero();  // the last may not be finite
    double small = tolerance * tolerance * std::max(precondition(0.0, contacts), reference_);
    turn_from(change_, 0.0);
    multiply(contacts);
    residual_.leftCols(count) -= image_.leftCols(count);
    double rho = precondition(0.0, contacts);
    small = std::max(small, within * within * rho);
    turn_from(preconditioned_, 0.0);
    for (int iteration = 0; iteration < iterations && rho > small; ++iteration) {
        multiply(contacts);
        const double curvature = kernels_->dot(awake_, direction_.data(), image_.data());
        if (!(curvature > 0.0)) break;
        const double next = precondition(rho / curvature, contacts);
        turn_from(preconditioned_, next / rho);
        rho = next;
    }
    return std::isfinite(rho);
}

/// Of pieces that nothing holds, what the iterations have left open of the momentum.
void RegionSystem::close_momentum() {
    if (piece_inertia_.empty()) return;
    left_.setZero();
    std::fill(piece_inertia_.begin(), piece_inertia_.end(), 0.0);
    const auto each = [&](const auto& act) {
        for (std::size_t n = 0; n < awake_; ++n) {
            const Index piece = region_->levels()[nodes_[n].level].piece[at(nodes_[n].node)];
            if (piece >= 0) act(eigen_index(n), piece);
        }
    };
    each([&](Eigen::Index n, Index piece) {
        left_.col(piece) += residual_.col(n).head<3>();
        piece_inertia_[at(piece)] += inertia_[at(static_cast<Index>(n))];
    });
    each(
        [&](Eigen::Index n, Index piece) { change_.col(n).head<3>() += left_.col(piece) / piece_inertia_[at(piece)]; });
}

/// How much of its spring each contact that slides is left with, from the velocities that the last parts have led to.
/// Gives the largest change of a force, N.
double RegionSystem::rub(double h, TickContacts& contacts) {
    contacts.gather_grip();
    const std::span<TickContact> all = contacts.all();
    const TissueState& state = tissue_->state();
    double change = 0.0;
    for (std::size_t c = 0; c < all.size(); ++c) {
        TickContact& contact = all[c];
        if (!contact.rubs) continue;
        Row& row = rows_[c];
        const bool grips = contacts.grips(c);
        if (!grips && row.part == 0.0) continue;
        const double most = grips ? contacts.grip(contacts.given(contact).slip_key).most : 0.0;
        if (row.part == 0.0) {
            // Did not press before: holds from now on.
            hold_along(h, c, 1.0, contacts);
            change = std::max(change, most);
            continue;
        }
        const Vector3 speed =
            along_surface(speed_of(contact, [&](Index local) { return state.velocity.col(local).head<3>(); }), contact);
        const double before = row.part;
        contact.rubbed = -row.stretched - row.slope * speed;
        const double wanted = contact.rubbed.norm() / before;  // by the whole spring
        const double part = !grips ? 0.0 : wanted > most ? most / wanted : 1.0;
        hold_along(h, c, part, contacts);
        if (part == 0.0) contact.rubbed.setZero();
        change = std::max(change, std::abs(part - before) * wanted);
        if (contact.rubbed.norm() > most) contact.rubbed *= most / contact.rubbed.norm();
    }
    return change;
}

/// Tangential springs after the step: stretched by the way along the surface where they stick, as long as their force
/// asks where they slide.
void RegionSystem::stretch_slips(double h, TickContacts& contacts) {
    contacts.gather_grip();
    const TissueState& state = tissue_->state();
    for (std::size_t c = 0; c < contacts.all().size(); ++c) {
        TickContact& contact = contacts.all()[c];
        if (!contact.rubs || !contacts.grips(c)) continue;
        const double most = contacts.grip(contacts.given(contact).slip_key).most;
        if (contact.rubbed.norm() > most) contact.rubbed *= most / contact.rubbed.norm();
        contacts.stretch(c, h * speed_of(contact, [&](Index local) { return state.velocity.col(local).head<3>(); }));
    }
}

double RegionSystem::move(double h) {
    TissueState& state = tissue_->state();
    std::vector<RegionLevel>& levels = region_->levels();
    double furthest = 0.0;
    bool finite = true;
    for (std::size_t n = 0; n < awake_; ++n) {
        const Index node = nodes_[n].node;
        RegionLevel& here = levels[nodes_[n].level];
        const bool vertex = nodes_[n].level == 0;
        if (vertex && !state.moves(node)) continue;
        Matrix4X& velocity = vertex ? state.velocity : here.velocity;
        Matrix4X& place = vertex ? state.position : here.displacement;
        velocity.col(node) += change_.col(eigen_index(n));
        const Eigen::Vector4d way = h * velocity.col(node);
        place.col(node) += way;
        furthest = std::max(furthest, way.cwiseAbs().maxCoeff());
        finite = finite && way.allFinite();
    }
    region_->next_moment();
    for (std::size_t n = awake_; n < nodes_.size() && nodes_[n].level == 0; ++n) region_->refresh(0, nodes_[n].node);
    return finite ? furthest : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace trocar
