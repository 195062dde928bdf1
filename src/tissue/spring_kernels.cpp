// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "tissue/spring_kernels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tissue/spring_kernels.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "geometry/simd_targets.hpp"
#include "tissue/four_points-inl.hpp"
#include "tissue/spring_stencil-inl.hpp"

#ifndef TROCAR_SPRING_BLOCK
#define TROCAR_SPRING_BLOCK
namespace trocar {
/// Springs evaluated between two updates of vertices.
constexpr std::size_t spring_block = 128;
}  // namespace trocar
#endif

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

/// Column of `force` that holds spring s.
HWY_INLINE Index spot(const SpringArrays& springs, std::size_t s) {
    return static_cast<Index>(s & (static_cast<std::size_t>(springs.force.cols()) - 1));
}

/// One spring at a time: the remainder after the vectors, and CPUs without vectors of four doubles.
HWY_INLINE void find_one_force(SpringArrays& springs, std::size_t s, const TissueState& state) {
    const double* const xi = column(state.position, springs.i[s]);
    const double* const xj = column(state.position, springs.j[s]);
    const double* const vi = column(state.velocity, springs.i[s]);
    const double* const vj = column(state.velocity, springs.j[s]);
    const double d[3] = {xj[0] - xi[0], xj[1] - xi[1], xj[2] - xi[2]};
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const double inverse = 1.0 / length;
    const double closing = ((vj[0] - vi[0]) * d[0] + (vj[1] - vi[1]) * d[1] + (vj[2] - vi[2]) * d[2]) * inverse;
    const double tension = springs.k[s] * length + springs.offset[s] + springs.damping[s] * closing;
    const double scale = length == 0.0 ? 0.0 : tension * inverse;
    double* const force = column(springs.force, spot(springs, s));
    for (int axis = 0; axis < 3; ++axis) force[axis] = scale * d[axis];
}

HWY_INLINE double stretch_of(const SpringArrays& springs, std::size_t s, const TissueState& state) {
    const double* const xi = column(state.position, springs.i[s]);
    const double* const xj = column(state.position, springs.j[s]);
    const double d[3] = {xj[0] - xi[0], xj[1] - xi[1], xj[2] - xi[2]};
    return std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * springs.inverse_rest[s];
}

#if HWY_MAX_BYTES >= 32

HWY_INLINE Vector difference(const SpringArrays& springs, std::size_t s, const Matrix4X& of) {
    const Four d;
    return hn::Sub(hn::LoadU(d, column(of, springs.j[s])), hn::LoadU(d, column(of, springs.i[s])));
}

/// Springs first <= s < end.
HWY_INLINE void find_forces(SpringArrays& springs, std::size_t first, std::size_t end, const TissueState& state) {
    const Four d;
    // Local pointers, because the compiler would otherwise reload them after every store.
    const double* const position = state.position.data();
    const double* const velocity = state.velocity.data();
    double* const force = springs.force.data();
    const std::size_t last_spot = static_cast<std::size_t>(springs.force.cols()) - 1;
    const Index* const i = springs.i.data();
    const Index* const j = springs.j.data();
    const double* const k = springs.k.data();
    const double* const offset = springs.offset.data();
    const double* const damping = springs.damping.data();
    const auto along = [&](const double* of, std::size_t s) HWY_ATTR {
        return hn::Sub(hn::LoadU(d, of + 4 * static_cast<std::ptrdiff_t>(j[s])),
                       hn::LoadU(d, of + 4 * static_cast<std::ptrdiff_t>(i[s])));
    };
    const auto keep = [&](std::size_t s, Vector value) HWY_ATTR { hn::StoreU(value, d, force + 4 * (s & last_spot)); };
    std::size_t s = first;
    for (; s + 4 <= end; s += 4) {
        const auto d0 = along(position, s);
        const auto d1 = along(position, s + 1);
        const auto d2 = along(position, s + 2);
        const auto d3 = along(position, s + 3);
        Vector x, y, z, vx, vy, vz;
        transpose(d0, d1, d2, d3, x, y, z);
        transpose(along(velocity, s), along(velocity, s + 1), along(velocity, s + 2), along(velocity, s + 3), vx, vy,
                  vz);
        const auto length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
        const auto inverse = hn::Div(hn::Set(d, 1.0), length);
        const auto closing = hn::Mul(hn::Add(hn::Add(hn::Mul(vx, x), hn::Mul(vy, y)), hn::Mul(vz, z)), inverse);
        const auto elastic = hn::Add(hn::Mul(hn::LoadU(d, k + s), length), hn::LoadU(d, offset + s));
        const auto tension = hn::Add(elastic, hn::Mul(hn::LoadU(d, damping + s), closing));
        const auto scale = hn::IfThenZeroElse(hn::Eq(length, hn::Zero(d)), hn::Mul(tension, inverse));
        const auto lower = hn::ConcatLowerLower(d, scale, scale);
        const auto upper = hn::ConcatUpperUpper(d, scale, scale);
        keep(s, hn::Mul(hn::DupEven(lower), d0));
        keep(s + 1, hn::Mul(hn::DupOdd(lower), d1));
        keep(s + 2, hn::Mul(hn::DupEven(upper), d2));
        keep(s + 3, hn::Mul(hn::DupOdd(upper), d3));
    }
    for (; s < end; ++s) find_one_force(springs, s, state);
}

double largest_stretch(const SpringArrays& springs, const TissueState& state) {
    const Four d;
    auto most = hn::Zero(d);
    auto least = hn::Zero(d);  // lower bound on the square of the largest stretch so far
    // Exceeds the rounding difference between the two formulae for a stretch.
    const auto shrunk = hn::Set(d, 1.0 - 1e-12);
    std::size_t s = 0;
    for (; s + 4 <= springs.size(); s += 4) {
        Vector x, y, z;
        transpose(difference(springs, s, state.position), difference(springs, s + 1, state.position),
                  difference(springs, s + 2, state.position), difference(springs, s + 3, state.position), x, y, z);
        const auto square = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
        const auto inverse_rest = hn::LoadU(d, &springs.inverse_rest[s]);
        // The square root is taken only where it may change the maximum.
        if (hn::AllTrue(d, hn::Lt(hn::Mul(hn::Mul(square, inverse_rest), inverse_rest), least))) continue;
        most = hn::Max(most, hn::Mul(hn::Sqrt(square), inverse_rest));
        const auto largest = hn::MaxOfLanes(d, most);
        least = hn::Mul(hn::Mul(largest, largest), shrunk);
    }
    double result = hn::GetLane(hn::MaxOfLanes(d, most));
    for (; s < springs.size(); ++s) result = std::max(result, stretch_of(springs, s, state));
    return result;
}

/// Moves vertices and accumulates a SubStepCheck.
class Mover {
public:
    HWY_INLINE Mover(double h, const SpringArrays& springs, TissueState& state)
        : h_(h), springs_(&springs), state_(&state) {}
    /// Vertices first <= v < end.
    HWY_INLINE void move(std::size_t first, std::size_t end) {
        const Four d;
        const double* const force = springs_->force.data();
        const std::size_t last_spot = static_cast<std::size_t>(springs_->force.cols()) - 1;
        const std::uint32_t* const first_out = springs_->first_out.data();
        const std::uint32_t* const first_in = springs_->first_in.data();
        const std::uint32_t* const in = springs_->in.data();
        const double* const constant = state_->constant.data();
        const double* const inverse_mass = state_->inverse_mass.data();
        const double* const drag = state_->drag.data();
        double* const velocities = state_->velocity.data();
        double* const positions = state_->position.data();
        auto furthest = furthest_;
        auto not_finite = not_finite_;
        for (std::size_t v = first; v < end; ++v) {
            if (inverse_mass[v] == 0.0) continue;
            const auto old = hn::LoadU(d, velocities + 4 * v);
            auto sum = hn::Sub(hn::LoadU(d, constant + 4 * v), hn::Mul(hn::Set(d, drag[v]), old));
            for (std::uint32_t e = first_in[v]; e < first_in[v + 1]; ++e) {
                sum = hn::Sub(sum, hn::LoadU(d, force + 4 * (in[e] & last_spot)));
            }
            for (std::size_t s = first_out[v]; s < first_out[v + 1]; ++s) {
                sum = hn::Add(sum, hn::LoadU(d, force + 4 * (s & last_spot)));
            }
            const auto velocity = hn::Add(old, hn::Mul(hn::Set(d, h_ * inverse_mass[v]), sum));
            const auto path = hn::Mul(hn::Set(d, h_), velocity);
            const auto position = hn::Add(hn::LoadU(d, positions + 4 * v), path);
            hn::StoreU(velocity, d, velocities + 4 * v);
            hn::StoreU(position, d, positions + 4 * v);
            furthest = hn::Max(furthest, hn::Abs(path));
            not_finite = hn::Add(not_finite, hn::Mul(hn::Add(position, velocity), hn::Zero(d)));
        }
        furthest_ = furthest;
        not_finite_ = not_finite;
    }
    HWY_INLINE SubStepCheck check() const {
        const Four d;
        return {.furthest = hn::GetLane(hn::MaxOfLanes(d, furthest_)),
                .finite = hn::GetLane(hn::SumOfLanes(d, not_finite_)) == 0.0};
    }

private:
    double h_;
    const SpringArrays* springs_;
    TissueState* state_;
    Vector furthest_ = hn::Zero(Four());
    Vector not_finite_ = hn::Zero(Four());  // a finite number times zero is zero; infinities and NaN give NaN
};

#else

HWY_INLINE void find_forces(SpringArrays& springs, std::size_t first, std::size_t end, const TissueState& state) {
    for (std::size_t s = first; s < end; ++s) find_one_force(springs, s, state);
}

double largest_stretch(const SpringArrays& springs, const TissueState& state) {
    double result = 0.0;
    for (std::size_t s = 0; s < springs.size(); ++s) result = std::max(result, stretch_of(springs, s, state));
    return result;
}

/// Moves vertices and accumulates a SubStepCheck.
class Mover {
public:
    Mover(double h, const SpringArrays& springs, TissueState& state) : h_(h), springs_(&springs), state_(&state) {}
    /// Vertices first <= v < end.
    void move(std::size_t first, std::size_t end) {
        for (std::size_t v = first; v < end; ++v) {
            const double inverse_mass = state_->inverse_mass[v];
            const auto local = static_cast<Index>(v);
            if (inverse_mass == 0.0) continue;
            double* const velocity = column(state_->velocity, local);
            double* const position = column(state_->position, local);
            for (int axis = 0; axis < 3; ++axis) {
                double force = column(state_->constant, local)[axis] - state_->drag[v] * velocity[axis];
                for (std::uint32_t e = springs_->first_in[v]; e < springs_->first_in[v + 1]; ++e) {
                    force -= column(springs_->force, spot(*springs_, springs_->in[e]))[axis];
                }
                for (std::uint32_t s = springs_->first_out[v]; s < springs_->first_out[v + 1]; ++s) {
                    force += column(springs_->force, spot(*springs_, s))[axis];
                }
                velocity[axis] += h_ * inverse_mass * force;
                const double path = h_ * velocity[axis];
                position[axis] += path;
                furthest_ = std::max(furthest_, std::abs(path));
                not_finite_ += (position[axis] + velocity[axis]) * 0.0;
            }
        }
    }
    [[nodiscard]] SubStepCheck check() const { return {.furthest = furthest_, .finite = not_finite_ == 0.0}; }

private:
    double h_;
    const SpringArrays* springs_;
    TissueState* state_;
    double furthest_ = 0.0;
    double not_finite_ = 0.0;  // a finite number times zero is zero; infinities and NaN give NaN
};

#endif

void take_over(const Matrix3X& from, Range range, Index local, Matrix4X& to) {
    const double* source = from.data() + 3 * static_cast<std::ptrdiff_t>(range.first);
    double* target = column(to, local);
    Index left = range.count;
#if HWY_MAX_BYTES >= 32
    const Four d;
    // A vector load also reads the first number of the next column, which the last column does not have.
    for (; left > 1; --left, source += 3, target += 4) {
        hn::StoreU(hn::IfThenElseZero(hn::FirstN(d, 3), hn::LoadU(d, source)), d, target);
    }
#endif
    for (; left > 0; --left, source += 3, target += 4) std::copy_n(source, 3, target);
}

void give_back(const Matrix4X& from, Index local, Range range, Matrix3X& to) {
    const double* source = column(from, local);
    double* target = to.data() + 3 * static_cast<std::ptrdiff_t>(range.first);
    Index left = range.count;
#if HWY_MAX_BYTES >= 32
    const Four d;
    // The fourth lane is overwritten by the next column's first number.
    for (; left > 1; --left, source += 4, target += 3) hn::StoreU(hn::LoadU(d, source), d, target);
#endif
    for (; left > 0; --left, source += 4, target += 3) std::copy_n(source, 3, target);
}

/// Vertices move in blocks as soon as all their springs are evaluated, so that the forces are still in the cache.
SubStepCheck sub_step(double h, SpringArrays& springs, TissueState& state) {
#if HWY_MAX_BYTES >= 32
    if (!springs.stencil.empty()) return StencilStep(h, springs.stencil, state).run();
#endif
    Mover mover(h, springs, state);
    std::size_t moved = 0;
    for (std::size_t s = 0; s < springs.size(); s += spring_block) {
        const std::size_t end = std::min(s + spring_block, springs.size());
        find_forces(springs, s, end, state);
        if (end == springs.size()) break;
        const auto front = static_cast<std::size_t>(springs.i[end]);
        mover.move(moved, front);
        moved = front;
    }
    mover.move(moved, state.size());
    return mover.check();
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(sub_step);
HWY_EXPORT(largest_stretch);
HWY_EXPORT(take_over);
HWY_EXPORT(give_back);

SpringArrays spring_arrays(std::vector<Spring>& springs, const std::vector<Index>& place, std::size_t vertex_count) {
    const auto local = [&place](Index vertex) { return place[static_cast<std::size_t>(vertex)]; };
    for (Spring& spring : springs) {
        if (local(spring.i) > local(spring.j)) std::swap(spring.i, spring.j);
    }
    std::stable_sort(springs.begin(), springs.end(),
                     [&](const Spring& one, const Spring& other) { return local(one.i) < local(other.i); });
    SpringArrays arrays;
    arrays.first_out.assign(vertex_count + 1, 0);
    arrays.first_in.assign(vertex_count + 1, 0);
    for (const Spring& spring : springs) {
        arrays.i.push_back(local(spring.i));
        arrays.j.push_back(local(spring.j));
        arrays.inverse_rest.push_back(spring.rest > 0.0 ? 1.0 / spring.rest : 0.0);
        arrays.k.push_back(spring.k);
        arrays.offset.push_back(spring.preload - spring.k * spring.rest);
        arrays.damping.push_back(spring.damping);
        ++arrays.first_out[static_cast<std::size_t>(arrays.i.back()) + 1];
        ++arrays.first_in[static_cast<std::size_t>(arrays.j.back()) + 1];
    }
    for (std::size_t v = 0; v < vertex_count; ++v) {
        arrays.first_out[v + 1] += arrays.first_out[v];
        arrays.first_in[v + 1] += arrays.first_in[v];
    }
    arrays.in.resize(springs.size());
    std::vector<std::uint32_t> next = arrays.first_in;
    std::size_t longest = 1;  // springs evaluated between one and the update of its j
    for (std::size_t s = 0; s < springs.size(); ++s) {
        const auto j = static_cast<std::size_t>(arrays.j[s]);
        arrays.in[next[j]++] = static_cast<std::uint32_t>(s);
        longest = std::max(longest, arrays.first_out[j + 1] - s);
    }
    arrays.force.setZero(4, static_cast<Eigen::Index>(std::bit_ceil(longest + 2 * spring_block)));
    return arrays;
}

const std::vector<SpringKernels>& spring_kernels() {
    static const std::vector<SpringKernels> kernels = versions_by_target([](const char* target) {
        return SpringKernels{.sub_step = &HWY_DYNAMIC_DISPATCH(sub_step),
                             .largest_stretch = &HWY_DYNAMIC_DISPATCH(largest_stretch),
                             .take_over = &HWY_DYNAMIC_DISPATCH(take_over),
                             .give_back = &HWY_DYNAMIC_DISPATCH(give_back),
                             .target = target};
    });
    return kernels;
}

}  // namespace trocar
#endif
