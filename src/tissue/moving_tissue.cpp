#include "tissue/moving_tissue.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tissue/mass_spring.hpp"
#include "tissue/stability.hpp"

namespace trocar {
namespace {

/// Tests the bits without the sign and does not exit early, so that the loop vectorises.
bool all_zero(const Matrix3X& matrix) {
    std::uint64_t bits = 0;
    for (Eigen::Index e = 0; e < matrix.size(); ++e) bits |= std::bit_cast<std::uint64_t>(matrix.data()[e]) << 1;
    return bits == 0;
}

/// False: the input is already not finite, so the integrator is not the cause.
bool finite_input(const ResponseOutput& output, const Frame& frame) {
    const auto all_finite = [](const ContactForceLaw& contact) {
        return std::isfinite(contact.gap) && std::isfinite(contact.k) && std::isfinite(contact.mu) &&
               std::isfinite(contact.face_velocity) && contact.normal.allFinite() &&
               std::all_of(contact.weights.begin(), contact.weights.end(), [](double w) { return std::isfinite(w); }) &&
               std::all_of(contact.reaction_weights.begin(), contact.reaction_weights.end(),
                           [](double w) { return std::isfinite(w); });
    };
    return frame.position.allFinite() && frame.velocity.allFinite() && output.held_force.allFinite() &&
           std::all_of(output.contacts.begin(), output.contacts.end(), all_finite) &&
           std::all_of(output.position_corrections.begin(), output.position_corrections.end(),
                       [](const PositionCorrection& position_correction) {
                           return position_correction.position.allFinite() && position_correction.velocity.allFinite();
                       });
}

/// Free vertices of the tissue, and vertices that share a spring or enclosure with one.
TissueState state_of(const Topology& topology, const Materials& materials) {
    const std::size_t n = at(topology.vertex_count);
    std::vector<std::uint8_t> free(n, 0);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) free[at(v)] = materials.is_free(v) ? 1 : 0;
    }
    std::vector<std::uint8_t> taken = free;
    for (const Spring& spring : materials.springs) {
        if (free[at(spring.i)] == 0 && free[at(spring.j)] == 0) continue;
        taken[at(spring.i)] = taken[at(spring.j)] = 1;
    }
    const auto is_moved = [&](Index v) { return free[at(v)] != 0; };
    for (const Enclosure& enclosure : materials.enclosures) {
        const std::span<const Index> corners(enclosure.triangles.data(),
                                             static_cast<std::size_t>(enclosure.triangles.size()));
        if (std::none_of(corners.begin(), corners.end(), is_moved)) continue;
        for (const Index v : corners) taken[at(v)] = 1;
    }
    TissueState state;
    state.place.assign(n, -1);
    for (Index v = 0; v < topology.vertex_count; ++v) {
        if (taken[at(v)] == 0) continue;
        state.place[at(v)] = static_cast<Index>(state.vertex.size());
        if (state.ranges.empty() || state.ranges.back().end() != v) state.ranges.push_back({v, 0});
        ++state.ranges.back().count;
        state.vertex.push_back(v);
        state.inverse_mass.push_back(free[at(v)] != 0 ? 1.0 / materials.mass[at(v)] : 0.0);
        state.drag.push_back(materials.drag.empty() ? 0.0 : materials.drag[at(v)]);
    }
    const auto columns = static_cast<Eigen::Index>(state.size());
    for (Matrix4X* array : {&state.position, &state.velocity, &state.constant}) array->setZero(4, columns);
    return state;
}

/// Springs with at least one free end.
std::vector<Spring> moving_springs(const Materials& materials, const TissueState& state) {
    std::vector<Spring> springs;
    for (const Spring& spring : materials.springs) {
        const Index i = state.place[at(spring.i)];
        const Index j = state.place[at(spring.j)];
        if (i >= 0 && j >= 0 && (state.moves(i) || state.moves(j))) springs.push_back(spring);
    }
    return springs;
}

}  // namespace

MovingTissue::MovingTissue(const Topology& topology, const Materials& materials)
    : materials_(&materials),
      kernels_(&spring_kernels().front()),
      state_(state_of(topology, materials)),
      volumes_(materials, state_.place) {
    springs_ = moving_springs(materials, state_);
    arrays_ = trocar::spring_arrays(springs_, state_.place, state_.size());
    set_constant_force(nullptr);
    for (const Spring& spring : materials.springs) extent_ += spring.rest;
    limited_.assign(springs_.size(), 0);
}

/// Calls act(position correction) for each position correction of a free vertex of the state; pinned vertices are
/// skipped.
template <typename Act>
void MovingTissue::each_placed(const ResponseOutput& output, const Act& act) const {
    for (const PositionCorrection& position_correction : output.position_corrections) {
        if (state_.place[at(position_correction.vertex)] >= 0 && materials_->is_free(position_correction.vertex))
            act(position_correction);
    }
}

void MovingTissue::take_over(const ResponseOutput& output, const Frame& frame) {
    for (const Range& range : state_.ranges) {
        const Index local = state_.place[at(range.first)];
        kernels_->take_over(frame.position, range, local, state_.position);
        kernels_->take_over(frame.velocity, range, local, state_.velocity);
    }
    take_output(output, frame);
}

void MovingTissue::take_output(const ResponseOutput& output, const Frame& frame) {
    const bool pushed = output.held_force.cols() == frame.position.cols() && !all_zero(output.held_force);
    if (pushed || pushed_) set_constant_force(pushed ? &output.held_force : nullptr);
    pushed_ = pushed;
    each_placed(output, [&](const PositionCorrection& position_correction) {
        const Index local = state_.place[at(position_correction.vertex)];
        state_.position.col(local).head<3>() = position_correction.position;
        state_.velocity.col(local).head<3>() = position_correction.velocity;
        if (position_correction.held) state_.inverse_mass[at(local)] = 0.0;
    });
}

/// Rest bias plus the optional force held over the tick (3×N, N).
void MovingTissue::set_constant_force(const Matrix3X* held) {
    for (std::size_t i = 0; i < state_.size(); ++i) {
        const Index v = state_.vertex[i];
        auto constant = state_.constant.col(static_cast<Eigen::Index>(i)).head<3>();
        constant.setZero();
        if (v < materials_->rest_bias.cols()) constant = materials_->rest_bias.col(v);
        if (held != nullptr) constant += held->col(v);
    }
    if (!volumes_.none()) held_force_ = state_.constant;
}

void MovingTissue::add_volume_force() {
    if (volumes_.none()) return;
    state_.constant = held_force_;
    trocar::add_volume_force(volumes_.enclosures(), state_.position.topRows<3>(), state_.constant.topRows<3>());
}

double MovingTissue::put_aside(Index local, const Vector3& by) {
    const auto energy = [&] {
        double sum = 0.0;
        const auto add = [&](std::size_t number) {
            const Eigen::Vector4d path =
                state_.position.col(arrays_.j[number]) - state_.position.col(arrays_.i[number]);
            sum += spring_energy(springs_[number], path.norm());
        };
        for (std::size_t s = arrays_.first_out[at(local)]; s < arrays_.first_out[at(local) + 1]; ++s) add(s);
        for (std::size_t n = arrays_.first_in[at(local)]; n < arrays_.first_in[at(local) + 1]; ++n) add(arrays_.in[n]);
        return sum;
    };
    const double before = energy();
    state_.position.col(local).head<3>() += by;
    const Matrix3X& bias = materials_->rest_bias;
    const double lifted = bias.cols() > 0 ? bias.col(state_.vertex[at(local)]).dot(by) : 0.0;
    return energy() - before - lifted;
}

void MovingTissue::release(const ResponseOutput& output) {
    each_placed(output, [&](const PositionCorrection& position_correction) {
        state_.inverse_mass[at(state_.place[at(position_correction.vertex)])] =
            1.0 / materials_->mass[at(position_correction.vertex)];
    });
}

void MovingTissue::give_back(const ResponseOutput& output, const Frame& from, Frame& to) const {
    for (const Range& range : state_.ranges) give_back_part(range, state_.place[at(range.first)], from, to);
    give_back_placed(output, to);
}

void MovingTissue::give_back_part(Range vertices, Index local, const Frame& from, Frame& to) const {
    to.previous.middleCols(vertices.first, vertices.count) = from.position.middleCols(vertices.first, vertices.count);
    kernels_->give_back(state_.position, local, vertices, to.position);
    kernels_->give_back(state_.velocity, local, vertices, to.velocity);
}

void MovingTissue::give_back_placed(const ResponseOutput& output, Frame& to) const {
    each_placed(output, [&](const PositionCorrection& position_correction) {
        to.previous.col(position_correction.vertex) = position_correction.position;
    });
}

Outcome MovingTissue::check(bool finite, double bound, const ResponseOutput& output, const Frame& frame) const {
    if (!finite && !finite_input(output, frame)) {
        return {OutcomeKind::not_finite, "a tissue vertex left the finite numbers"};
    }
    if (!finite || (extent_ > 0.0 && bound > extent_ && furthest(start_of(output, frame)) > extent_)) {
        return {OutcomeKind::unstable, "a tissue vertex moved further in one tick than all springs are long"};
    }
    return {};
}

double MovingTissue::placed_move(const ResponseOutput& output, const Frame& frame) const {
    double square = 0.0;
    each_placed(output, [&](const PositionCorrection& position_correction) {
        square = std::max(
            square, (position_correction.position - frame.position.col(position_correction.vertex)).squaredNorm());
    });
    return std::sqrt(square);
}

double MovingTissue::longest_path(const Matrix3X& start) const {
    double square = 0.0;
    for (std::size_t i = 0; i < state_.size(); ++i) {
        const Vector3 path = state_.position.col(static_cast<Eigen::Index>(i)).head<3>() - start.col(state_.vertex[i]);
        square = std::max(square, path.squaredNorm());
    }
    return std::sqrt(square);
}

/// Largest displacement of a vertex along one axis since the start of the tick, m.
double MovingTissue::furthest(const Matrix3X& start) const {
    double furthest = 0.0;
    for (std::size_t i = 0; i < state_.size(); ++i) {
        const Vector3 path = state_.position.col(static_cast<Eigen::Index>(i)).head<3>() - start.col(state_.vertex[i]);
        furthest = std::max(furthest, path.cwiseAbs().maxCoeff());
    }
    return furthest;
}

Matrix3X MovingTissue::start_of(const ResponseOutput& output, const Frame& frame) const {
    Matrix3X start = frame.position;
    each_placed(output, [&](const PositionCorrection& position_correction) {
        start.col(position_correction.vertex) = position_correction.position;
    });
    return start;
}

void MovingTissue::limit_strain() {
    const double longest = 1.0 + materials_->strain_limit;
    limited_edges_ = 0;
    double stretch = kernels_->largest_stretch(arrays_, state_);
    constexpr double rounding = 1e-12;
    if (stretch > longest * (1.0 - rounding)) {
        limit_every_spring(longest);
        stretch = kernels_->largest_stretch(arrays_, state_);
    }
    max_strain_ = std::max(0.0, stretch - 1.0);
}

void MovingTissue::limit_every_spring(double longest) {
    std::fill(limited_.begin(), limited_.end(), std::uint8_t{0});
    for (int pass = 0; pass < limit_passes; ++pass) {
        for (std::size_t s = 0; s < arrays_.size(); ++s) {
            const Index i = arrays_.i[s];
            const Index j = arrays_.j[s];
            const double limit = longest * springs_[s].rest;
            if (limit <= 0.0) continue;
            if (shorten(i, j, limit, state_.inverse_mass[at(i)], state_.inverse_mass[at(j)], state_)) limited_[s] = 1;
        }
    }
    limited_edges_ = std::count(limited_.begin(), limited_.end(), std::uint8_t{1});
}

bool shorten(Index i, Index j, double limit, double inverse_mass_i, double inverse_mass_j, TissueState& state) {
    const double sum = inverse_mass_i + inverse_mass_j;
    if (sum == 0.0) return false;
    const Vector3 d = (state.position.col(j) - state.position.col(i)).head<3>();
    const double length = d.norm();
    if (length <= limit) return false;
    const Vector3 u = d / length;
    const Vector3 correction = (length - limit) / sum * u;
    state.position.col(i).head<3>() += inverse_mass_i * correction;
    state.position.col(j).head<3>() -= inverse_mass_j * correction;
    const double opening = (state.velocity.col(j) - state.velocity.col(i)).head<3>().dot(u);
    if (opening > 0.0) {
        state.velocity.col(i).head<3>() += inverse_mass_i / sum * opening * u;
        state.velocity.col(j).head<3>() -= inverse_mass_j / sum * opening * u;
    }
    return true;
}

}  // namespace trocar
