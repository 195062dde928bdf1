#include "tissue/implicit_contacts.hpp"

#include <algorithm>
#include <cmath>

#include "tissue/active_set.hpp"

namespace trocar {
namespace {

constexpr std::size_t usual_rows = 256;

}  // namespace

ImplicitContacts::ImplicitContacts(std::size_t spring_count, std::size_t vertex_count)
    : compliance_(spring_count, vertex_count) {
    rows_.reserve(usual_rows);
    rub_rows_.reserve(usual_rows);
    force_.reserve(usual_rows);
    on_.reserve(usual_rows);
    has_column_.reserve(usual_rows);
    columns_.reserve(usual_rows);
    missing_.reserve(usual_rows);
    gap_.reserve(usual_rows);
    answer_.setZero(usual_rows, usual_rows);
    matrix_.setZero(usual_rows, usual_rows);
    right_side_.setZero(usual_rows);
}

void ImplicitContacts::solve(double h, bool known, const SpringArrays& springs, const SpringSystem& system,
                             const VolumeSystem& volumes, const TissueState& state, double tolerance, int iterations,
                             TickContacts& contacts) {
    const std::span<TickContact> all = contacts.all();
    if (all.empty()) return;
    list_rows(state, contacts);
    compliance_.begin(springs, system, contacts.touched());
    if (known && rows_.size() == all.size()) {  // no friction
        for (TickContact& contact : all) contact.force = contact.held;
        return;
    }
    question_ = {.volumes = &volumes, .contacts = &contacts, .tolerance = tolerance, .iterations = iterations};
    for (TickContact& contact : all) {
        const double rate = TickContacts::rate(contact, state);
        const bool touches = contact.bilateral || contact.depth >= 0.0;
        contact.on = touches && contact.pulls;
        contact.capped = false;
        // Explicit (negative) damping acts at the velocity of the free motion.
        if (!known) contact.held = touches ? -contact.explicit_damping * rate : 0.0;
        contact.force = known ? contact.held : 0.0;
        contact.rubbed.setZero();
    }
    // Alternates normal forces at fixed friction and friction at fixed normal forces, which couple through the tissue.
    constexpr int most_rounds = 200;
    constexpr double settled = 1e-6;  // of the largest force
    for (int round = 0; round < most_rounds; ++round) {
        if (!known) find_pressing(h, all);
        double largest = 0.0;
        for (std::size_t c = 0; c < all.size(); ++c) {
            force_[c] = all[c].force;
            largest = std::max(largest, std::abs(force_[c]));
        }
        if (rows_.size() > all.size()) answer_to(0, all.size(), [&](std::size_t c) { return force_[c] != 0.0; });
        if (rows_.size() == all.size() || rub(h, round > 0, contacts) <= settled * largest) break;
    }
}

void ImplicitContacts::add_impulses(double h, const TickContacts& contacts, Matrix4X& right_side) {
    for (const TickContact& contact : contacts.all()) {
        const Vector3 impulse = h * (contact.force * contact.normal + contact.rubbed);
        for (int i = 0; i < contact.count; ++i) {
            right_side.col(contact.vertex[at(i)]).head<3>() += contact.weight[at(i)] * impulse;
        }
    }
}

void ImplicitContacts::list_rows(const TissueState& state, TickContacts& contacts) {
    rows_.clear();
    const std::span<TickContact> all = contacts.all();
    const auto free_rate = [&state](const TickContact& contact, const Vector3& direction) {
        double rate = -contact.surface.dot(direction);
        for (int i = 0; i < contact.count; ++i) {
            rate += contact.weight[at(i)] * state.velocity.col(contact.vertex[at(i)]).head<3>().dot(direction);
        }
        return rate;
    };
    for (std::size_t c = 0; c < all.size(); ++c) {
        rows_.push_back({c, all[c].normal, TickContacts::rate(all[c], state)});
    }
    rub_rows_.assign(all.size(), 0);
    for (std::size_t c = 0; c < all.size(); ++c) {
        if (!all[c].has_friction) continue;
        rub_rows_[c] = rows_.size();
        const Vector3 along = all[c].normal.unitOrthogonal();
        for (const Vector3& direction : {along, Vector3(all[c].normal.cross(along))}) {
            rows_.push_back({c, direction, free_rate(all[c], direction)});
        }
    }
    force_.assign(rows_.size(), 0.0);
    has_column_.assign(rows_.size(), 0);
    gap_.assign(all.size(), 0.0);
    columns_.clear();
}

template <typename Wanted>
void ImplicitContacts::answer_to(std::size_t first, std::size_t last, const Wanted& wanted) {
    missing_.clear();
    for (std::size_t r = first; r < last; ++r) {
        if (has_column_[r] == 0 && wanted(r)) missing_.push_back(r);
    }
    if (!missing_.empty()) find_columns();
}

/// Computes the rates of all rows per impulse on each missing row, eight of these at a time.
void ImplicitContacts::find_columns() {
    const std::size_t count = rows_.size();
    if (eigen_index(count) > answer_.rows()) {
        const Eigen::Index room = 2 * eigen_index(count);
        answer_.setZero(room, room);
        matrix_.setZero(room, room);
        right_side_.setZero(room);
    }
    const TickContacts& contacts = *question_.contacts;
    const std::span<const TickContact> all = contacts.all();
    const std::size_t before = columns_.size();
    for (std::size_t first = 0; first < missing_.size(); first += compliance_lanes) {
        const std::size_t lanes = std::min(compliance_lanes, missing_.size() - first);
        compliance_.clear();
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            const Row& row = rows_[missing_[first + lane]];
            const TickContact& contact = all[row.contact];
            for (int i = 0; i < contact.count; ++i) {
                compliance_.add(lane, contacts.spot(contact.vertex[at(i)]), contact.weight[at(i)] * row.direction);
            }
        }
        compliance_.solve(question_.tolerance, question_.iterations);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            const std::size_t column = missing_[first + lane];
            for (std::size_t r = 0; r < count; ++r) {
                const TickContact& contact = all[rows_[r].contact];
                double sum = 0.0;
                for (int i = 0; i < contact.count; ++i) {
                    const Vector3 path = compliance_.answer(lane, contacts.spot(contact.vertex[at(i)]));
                    sum += contact.weight[at(i)] * path.dot(rows_[r].direction);
                }
                answer_(eigen_index(r), eigen_index(column)) = sum;
            }
            has_column_[column] = 1;
            columns_.push_back(column);
        }
    }
    // An enclosure with answer y subtracts factor (J y)(J y)ᵀ, because A⁻¹ is symmetric.
    for (const VolumeSystem::Enclosed& enclosed : question_.volumes->enclosures()) {
        swell_.assign(count, 0.0);
        for (std::size_t r = 0; r < count; ++r) {
            const TickContact& contact = all[rows_[r].contact];
            for (int i = 0; i < contact.count; ++i) {
                swell_[r] += contact.weight[at(i)] *
                             enclosed.answer.col(contact.vertex[at(i)]).head<3>().dot(rows_[r].direction);
            }
        }
        for (const std::size_t column : missing_) {
            for (std::size_t r = 0; r < count; ++r) {
                answer_(eigen_index(r), eigen_index(column)) -= enclosed.factor * swell_[r] * swell_[column];
            }
        }
    }
    // Symmetrises the error of the iterations, because A⁻¹ is symmetric.
    for (std::size_t late = before; late < columns_.size(); ++late) {
        for (std::size_t early = 0; early < late; ++early) {
            double& one = answer_(eigen_index(columns_[early]), eigen_index(columns_[late]));
            double& other = answer_(eigen_index(columns_[late]), eigen_index(columns_[early]));
            one = other = 0.5 * (one + other);
        }
    }
}

double ImplicitContacts::rate(std::size_t row, double h) const {
    double sum = rows_[row].rate;
    for (const std::size_t other : columns_) sum += h * answer_(eigen_index(row), eigen_index(other)) * force_[other];
    return sum;
}

/// Initial guess of the active set. Most near contacts would press if no other did. The deepest therefore join first,
/// one batch of lanes per round, and the others are tested again.
void ImplicitContacts::guess_pressing(double h, std::span<TickContact> contacts) {
    for (std::size_t joined = 0; joined < contacts.size(); joined += compliance_lanes) {
        if (!solve_pressing(h, contacts)) return;
        missing_.clear();
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            TickContact& contact = contacts[c];
            if (contact.pulls || contact.solved) continue;
            if (contact.on && force_[c] < 0.0) contact.on = false;
            gap_[c] = h * rate(c, h) - contact.depth;
            if (!contact.on && has_column_[c] == 0 && gap_[c] < 0.0) missing_.push_back(c);
        }
        if (missing_.empty()) return;
        const std::size_t most = std::min(compliance_lanes, missing_.size());
        std::partial_sort(
            missing_.begin(), missing_.begin() + static_cast<std::ptrdiff_t>(most), missing_.end(),
            [&](std::size_t a, std::size_t b) { return gap_[a] < gap_[b] || (gap_[a] == gap_[b] && a < b); });
        for (std::size_t n = 0; n < most; ++n) contacts[missing_[n]].on = true;
    }
}

void ImplicitContacts::find_pressing(double h, std::span<TickContact> contacts) {
    const auto solved = [&] { return solve_pressing(h, contacts); };
    const auto rate_of = [&](const TickContact& contact) {
        return rate(static_cast<std::size_t>(&contact - contacts.data()), h);
    };
    guess_pressing(h, contacts);
    if (find_active(contacts, h, solved, rate_of)) return;
    answer_to(0, contacts.size(), [](std::size_t) { return true; });
    // Projected Gauss-Seidel from zero force, so that an unconverged solution gives less energy, never more.
    constexpr int most_sweeps = 200;
    constexpr double settled = 1e-6;  // of the largest force
    std::fill_n(force_.begin(), contacts.size(), 0.0);
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
        double largest = 0.0;
        double change = 0.0;
        for (std::size_t c = 0; c < contacts.size(); ++c) {
            TickContact& contact = contacts[c];
            const StepLaw law = contact.law(h);
            const double own = h * answer_(eigen_index(c), eigen_index(c));
            const double others = rate(c, h) - own * force_[c];
            double force = (law.force(others) + contact.held) / (1.0 + law.slope * own);
            if (!contact.pulls) force = std::max(force, 0.0);
            if (!contact.bilateral && contact.pulls && contact.depth < 0.0) force = 0.0;
            contact.force = contact.within_limit(force);
            change = std::max(change, std::abs(contact.force - force_[c]));
            largest = std::max(largest, std::abs(contact.force));
            force_[c] = contact.force;
        }
        if (change <= settled * largest) break;
    }
}

/// Solves f / c + h W f = F(r) / c for the forces of the active contacts; c is the slope of the law F. Returns false if
/// the matrix is not positive definite or a force is not finite.
bool ImplicitContacts::solve_pressing(double h, std::span<TickContact> contacts) {
    answer_to(0, contacts.size(), [&](std::size_t c) { return contacts[c].on; });
    on_.clear();
    for (std::size_t c = 0; c < contacts.size(); ++c) {
        const TickContact& contact = contacts[c];
        force_[c] = contact.capped ? contact.force : 0.0;
        if (!contact.on || contact.capped) continue;
        if (contact.law(h).slope > 0.0) {
            on_.push_back(c);
        } else {
            force_[c] = contact.held;
        }
    }
    const Eigen::Index count = eigen_index(on_.size());
    for (Eigen::Index a = 0; a < count; ++a) {
        const std::size_t c = on_[static_cast<std::size_t>(a)];
        const TickContact& contact = contacts[c];
        const StepLaw law = contact.law(h);
        for (Eigen::Index b = 0; b < count; ++b) {
            matrix_(a, b) = h * answer_(eigen_index(c), eigen_index(on_[static_cast<std::size_t>(b)]));
        }
        matrix_(a, a) += 1.0 / law.slope;
        right_side_[a] = (law.force(rate(c, h)) + contact.held) / law.slope;
    }
    Eigen::Ref<Eigen::MatrixXd> matrix = matrix_.topLeftCorner(count, count);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(matrix);
    if (factor.info() != Eigen::Success) return false;
    auto force = right_side_.head(count);
    factor.solveInPlace(force);
    for (Eigen::Index a = 0; a < count; ++a) {
        if (!std::isfinite(force[a])) return false;
        force_[on_[static_cast<std::size_t>(a)]] = force[a];
    }
    return true;
}

/// One Gauss-Seidel round of friction. An implicit tangential spring with a critical damper slides at friction × normal
/// force. `keep`: see TickContacts::gather_anchor. Returns the largest change of a force, N.
double ImplicitContacts::rub(double h, bool keep, TickContacts& contacts) {
    contacts.gather_anchor(keep);
    const std::span<TickContact> all = contacts.all();
    const auto has_friction = [&](std::size_t c) {
        const TickContacts::Anchor& anchor = contacts.anchor(contacts.given(all[c]).slip_key);
        return anchor.most > 0.0 && anchor.strongest == c;
    };
    answer_to(all.size(), rows_.size(), [&](std::size_t row) { return has_friction(rows_[row].contact); });
    double change = 0.0;
    for (std::size_t c = 0; c < all.size(); ++c) {
        const std::size_t first = rub_rows_[c];
        if (first == 0) continue;
        TickContact& contact = all[c];
        const ContactForceLaw& source = contacts.given(contact);
        const TickContacts::Anchor& anchor = contacts.anchor(source.slip_key);
        Vector3 rubbed = Vector3::Zero();
        if (has_friction(c)) {
            const Vector3 stretch = contacts.slip(source.slip_key);
            Eigen::Matrix2d own;
            Eigen::Vector2d speed, stretched;
            for (Eigen::Index a = 0; a < 2; ++a) {
                const std::size_t row = first + static_cast<std::size_t>(a);
                for (Eigen::Index b = 0; b < 2; ++b) {
                    own(a, b) = h * answer_(eigen_index(row), eigen_index(first + static_cast<std::size_t>(b)));
                }
                speed[a] = rate(row, h);
                stretched[a] = stretch.dot(rows_[row].direction);
            }
            speed -= own * Eigen::Vector2d(force_[first], force_[first + 1]);
            const double damping = 2.0 * std::sqrt(source.tangent_k * h / (0.5 * own.trace()));
            const double slope = damping + h * source.tangent_k;
            const Eigen::Vector2d push = -(source.tangent_k * stretched + slope * speed);
            const Eigen::Matrix2d matrix = Eigen::Matrix2d::Identity() + slope * own;
            Eigen::Vector2d sticking = matrix.inverse() * push;
            const double wanted = sticking.norm();
            if (wanted > anchor.most) sticking *= anchor.most / wanted;
            rubbed = sticking[0] * rows_[first].direction + sticking[1] * rows_[first + 1].direction;
        }
        change = std::max(change, (rubbed - contact.rubbed).norm());
        contact.rubbed = rubbed;
        for (std::size_t a = 0; a < 2; ++a) force_[first + a] = rubbed.dot(rows_[first + a].direction);
    }
    return change;
}

}  // namespace trocar
