// The sub-step of springs grouped by offset (SpringStencil), for vectors of four or eight doubles. Operations and their
// order equal those of spring_kernels.cpp. Included once per instruction set.
#if defined(TROCAR_TISSUE_SPRING_STENCIL_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_TISSUE_SPRING_STENCIL_INL
#undef TROCAR_TISSUE_SPRING_STENCIL_INL
#else
#define TROCAR_TISSUE_SPRING_STENCIL_INL
#endif

#include <algorithm>
#include <array>

#include "tissue/four_points-inl.hpp"
#include "tissue/spring_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

#if HWY_MAX_BYTES >= 32

using Wide = hn::CappedTag<double, SpringStencil::group>;
using WideVector = hn::Vec<Wide>;

class StencilStep {
public:
    StencilStep(double h, SpringStencil& stencil, TissueState& state)
        : h_(h),
          stencil_(&stencil),
          state_(&state),
          query_distance_(stencil.query_distance),
          count_(stencil.offsets.size()),
          work_(stencil.work.data()) {}

    SubStepCheck run() {
        const std::size_t vertices = state_->size();
        for (std::size_t first = 0; first < vertices; first += SpringStencil::block) {
            const std::size_t end = std::min(first + SpringStencil::block, vertices);
            make_room(first);
            take_until(std::min(stencil_->groups * group, first + SpringStencil::block + query_distance_));
            for (std::size_t c = 0; c < count_; ++c) find_forces(c, first, end);
            move(first, end);
        }
        const Wide d;
        return {.furthest = hn::GetLane(hn::MaxOfLanes(d, furthest_)),
                .finite = hn::GetLane(hn::SumOfLanes(d, not_finite_)) == 0.0};
    }

private:
    static constexpr std::size_t group = SpringStencil::group;
    static constexpr std::size_t lanes = hn::MaxLanes(Wide());
    static constexpr unsigned all = (1U << lanes) - 1;  ///< bits of the vertices in one vector
    /// Stride between rows of the window.
    static constexpr std::size_t row = SpringStencil::window;
    static constexpr std::size_t force_rows = 6;  ///< position and velocity rows, before the first force

    /// Column of a vertex in the window. A block is preceded by `query_distance_` columns: forces of springs of earlier
    /// vertices, or empty columns before the first vertex.
    [[nodiscard]] std::size_t column_of(std::size_t v) const { return v + query_distance_ - start_; }

    /// Shifts the window when the block at `first` and the ends of its springs do not fit behind the last block.
    void make_room(std::size_t first) {
        const std::size_t end = column_of(first) + SpringStencil::block + query_distance_ + group;
        if (end <= SpringStencil::window) return;
        const std::size_t from = column_of(first) - query_distance_;
        const std::size_t until = column_of(taken_);
        for (std::size_t r = 0; r < force_rows + 3 * count_; ++r) {
            std::copy(work_ + r * row + from, work_ + r * row + until, work_ + r * row);
        }
        start_ = first;
    }

    /// Copies position and velocity up to vertex `end` by axis; the padding after the last vertex is at rest in the
    /// origin.
    void take_until(std::size_t end) {
        const double* const position = state_->position.data();
        const double* const velocity = state_->velocity.data();
        const std::size_t whole = std::min(end, state_->size() / group * group);
        double* to = work_ + column_of(taken_);
        for (; taken_ < whole; taken_ += group, to += group) {
            take(position + 4 * taken_, to);
            take(velocity + 4 * taken_, to + 3 * row);
        }
        if (taken_ >= end) return;
        const std::size_t left = state_->size() - taken_;
        std::array<double, 4 * group> padded{};
        std::copy_n(position + 4 * taken_, 4 * left, padded.data());
        take(padded.data(), to);
        std::copy_n(velocity + 4 * taken_, 4 * left, padded.data());
        take(padded.data(), to + 3 * row);
        taken_ += group;
    }
    HWY_INLINE static void take(const double* from, double* to) {
        const Four d;
        for (std::size_t half = 0; half < group; half += 4, from += 16, to += 4) {
            Vector x, y, z;
            transpose(hn::LoadU(d, from), hn::LoadU(d, from + 4), hn::LoadU(d, from + 8), hn::LoadU(d, from + 12), x, y,
                      z);
            hn::StoreU(x, d, to);
            hn::StoreU(y, d, to + row);
            hn::StoreU(z, d, to + 2 * row);
        }
    }

    /// Forces of the springs of offset number c from the vertices first <= i < end.
    void find_forces(std::size_t c, std::size_t first, std::size_t end) const {
        const Wide d;
        const std::size_t offset = stencil_->offsets[c];
        const double* constants = stencil_->constants.data() + (c * stencil_->groups + first / group) * 3 * group;
        const double* near = work_ + column_of(first);
        double* force = work_ + (force_rows + 3 * c) * row + column_of(first);
        for (std::size_t i = first; i < end; i += group, constants += 2 * group) {
            const bool none = stencil_->present[i / group * 2 * count_ + c] == 0;
            for (std::size_t part = 0; part < group; part += lanes, constants += lanes, near += lanes, force += lanes) {
                if (none) continue;
                const auto along = [near, offset](std::size_t r) HWY_ATTR {
                    return hn::Sub(hn::LoadU(Wide(), near + offset + r * row), hn::LoadU(Wide(), near + r * row));
                };
                const auto x = along(0);
                const auto y = along(1);
                const auto z = along(2);
                const auto length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
                const auto inverse = hn::Div(hn::Set(d, 1.0), length);
                const auto rate = hn::Add(hn::Add(hn::Mul(along(3), x), hn::Mul(along(4), y)), hn::Mul(along(5), z));
                const auto closing = hn::Mul(rate, inverse);
                const auto elastic = hn::Add(hn::Mul(hn::LoadU(d, constants), length), hn::LoadU(d, constants + group));
                const auto tension = hn::Add(elastic, hn::Mul(hn::LoadU(d, constants + 2 * group), closing));
                const auto scale = hn::IfThenZeroElse(hn::Eq(length, hn::Zero(d)), hn::Mul(tension, inverse));
                hn::StoreU(hn::Mul(scale, x), d, force);
                hn::StoreU(hn::Mul(scale, y), d, force + row);
                hn::StoreU(hn::Mul(scale, z), d, force + 2 * row);
            }
        }
    }

    /// Vertices first <= v < end; the forces of all their springs are known.
    void move(std::size_t first, std::size_t end) {
        auto furthest = furthest_;
        auto not_finite = not_finite_;
        const std::size_t whole = first + (end - first) / group * group;
        const double* const constant = state_->constant.data();
        const double* const drag = state_->drag.data();
        const double* const inverse_mass = state_->inverse_mass.data();
        double* const position = state_->position.data();
        double* const velocity = state_->velocity.data();
        for (std::size_t v = first; v < whole; v += lanes) {
            move_some(v, constant + 4 * v, drag + v, inverse_mass + v, position + 4 * v, velocity + 4 * v, furthest,
                      not_finite);
        }
        if (whole < end) {
            // The last group is padded with fixed vertices.
            std::array<double, 4 * group> constants{}, positions{}, velocities{};
            std::array<double, group> drags{}, inverse_masses{};
            const std::size_t left = end - whole;
            std::copy_n(constant + 4 * whole, 4 * left, constants.data());
            std::copy_n(drag + whole, left, drags.data());
            std::copy_n(inverse_mass + whole, left, inverse_masses.data());
            for (std::size_t part = 0; part < group; part += lanes) {
                move_some(whole + part, &constants[4 * part], &drags[part], &inverse_masses[part], &positions[4 * part],
                          &velocities[4 * part], furthest, not_finite);
            }
            std::copy_n(positions.data(), 4 * left, position + 4 * whole);
            std::copy_n(velocities.data(), 4 * left, velocity + 4 * whole);
        }
        furthest_ = furthest;
        not_finite_ = not_finite;
    }

    /// One vector of vertices from v on.
    HWY_INLINE void move_some(std::size_t v, const double* constant, const double* drag, const double* inverse_mass,
                              double* position, double* velocity, WideVector& all_furthest,
                              WideVector& all_not_finite) const {
        const Wide d;
        const double* const at = work_ + column_of(v);
        WideVector x, y, z;
        by_axis(constant, x, y, z);
        const auto old_x = hn::LoadU(d, at + 3 * row);
        const auto old_y = hn::LoadU(d, at + 4 * row);
        const auto old_z = hn::LoadU(d, at + 5 * row);
        const auto drags = hn::LoadU(d, drag);
        x = hn::Sub(x, hn::Mul(drags, old_x));
        y = hn::Sub(y, hn::Mul(drags, old_y));
        z = hn::Sub(z, hn::Mul(drags, old_z));
        add_forces(v, at, x, y, z);
        const auto masses = hn::LoadU(d, inverse_mass);
        const auto gain = hn::Mul(hn::Set(d, h_), masses);
        const auto moves = hn::Ne(masses, hn::Zero(d));
        const auto velocity_x = hn::Add(old_x, hn::Mul(gain, x));
        const auto velocity_y = hn::Add(old_y, hn::Mul(gain, y));
        const auto velocity_z = hn::Add(old_z, hn::Mul(gain, z));
        const auto path_x = hn::Mul(hn::Set(d, h_), velocity_x);
        const auto path_y = hn::Mul(hn::Set(d, h_), velocity_y);
        const auto path_z = hn::Mul(hn::Set(d, h_), velocity_z);
        const auto old_place_x = hn::LoadU(d, at);
        const auto old_place_y = hn::LoadU(d, at + row);
        const auto old_place_z = hn::LoadU(d, at + 2 * row);
        const auto place_x = hn::Add(old_place_x, path_x);
        const auto place_y = hn::Add(old_place_y, path_y);
        const auto place_z = hn::Add(old_place_z, path_z);
        const auto furthest = hn::Max(hn::Abs(path_x), hn::Max(hn::Abs(path_y), hn::Abs(path_z)));
        const auto sum =
            hn::Add(hn::Add(hn::Add(place_x, velocity_x), hn::Add(place_y, velocity_y)), hn::Add(place_z, velocity_z));
        if (hn::AllTrue(d, moves)) {
            all_furthest = hn::Max(all_furthest, furthest);
            all_not_finite = hn::Add(all_not_finite, hn::Mul(sum, hn::Zero(d)));
            give(place_x, place_y, place_z, position);
            give(velocity_x, velocity_y, velocity_z, velocity);
            return;
        }
        all_furthest = hn::Max(all_furthest, hn::IfThenElseZero(moves, furthest));
        all_not_finite = hn::Add(all_not_finite, hn::IfThenElseZero(moves, hn::Mul(sum, hn::Zero(d))));
        give(hn::IfThenElse(moves, place_x, old_place_x), hn::IfThenElse(moves, place_y, old_place_y),
             hn::IfThenElse(moves, place_z, old_place_z), position);
        give(hn::IfThenElse(moves, velocity_x, old_x), hn::IfThenElse(moves, velocity_y, old_y),
             hn::IfThenElse(moves, velocity_z, old_z), velocity);
    }
    HWY_INLINE static void four_by_axis(const double* from, Vector& x, Vector& y, Vector& z) {
        const Four d;
        transpose(hn::LoadU(d, from), hn::LoadU(d, from + 4), hn::LoadU(d, from + 8), hn::LoadU(d, from + 12), x, y, z);
    }
#if HWY_MAX_BYTES >= 64
    HWY_INLINE static void by_axis(const double* from, WideVector& x, WideVector& y, WideVector& z) {
        Vector x0, y0, z0, x1, y1, z1;
        four_by_axis(from, x0, y0, z0);
        four_by_axis(from + 16, x1, y1, z1);
        const Wide d;
        x = hn::Combine(d, x1, x0);
        y = hn::Combine(d, y1, y0);
        z = hn::Combine(d, z1, z0);
    }
    HWY_INLINE static void give(WideVector x, WideVector y, WideVector z, double* to) {
        const Four d;
        give_four(hn::LowerHalf(d, x), hn::LowerHalf(d, y), hn::LowerHalf(d, z), to);
        give_four(hn::UpperHalf(d, x), hn::UpperHalf(d, y), hn::UpperHalf(d, z), to + 16);
    }
#else
    HWY_INLINE static void by_axis(const double* from, WideVector& x, WideVector& y, WideVector& z) {
        four_by_axis(from, x, y, z);
    }
    HWY_INLINE static void give(WideVector x, WideVector y, WideVector z, double* to) { give_four(x, y, z, to); }
#endif
    HWY_INLINE static void give_four(Vector x, Vector y, Vector z, double* to) {
        const Four d;
        Vector p0, p1, p2, p3;
        transpose_back(x, y, z, p0, p1, p2, p3);
        hn::StoreU(p0, d, to);
        hn::StoreU(p1, d, to + 4);
        hn::StoreU(p2, d, to + 8);
        hn::StoreU(p3, d, to + 12);
    }

    /// Incoming springs in ascending order, which is descending offset, then the outgoing ones.
    HWY_INLINE void add_forces(std::size_t v, const double* at, WideVector& x, WideVector& y, WideVector& z) const {
        const Wide d;
        const std::size_t* const offsets = stencil_->offsets.data();
        const std::uint8_t* const out = stencil_->present.data() + v / group * 2 * count_;
        const std::uint8_t* const in = out + count_;
        const double* force = at + (force_rows + 3 * count_) * row;
        for (std::size_t c = count_; c-- > 0;) {
            force -= 3 * row;
            const unsigned there = in[c] >> v % group & all;
            if (there == 0) continue;
            const double* const from = force - offsets[c];
            const auto less_x = hn::Sub(x, hn::LoadU(d, from));
            const auto less_y = hn::Sub(y, hn::LoadU(d, from + row));
            const auto less_z = hn::Sub(z, hn::LoadU(d, from + 2 * row));
            replace(there, less_x, less_y, less_z, x, y, z);
        }
        for (std::size_t c = 0; c < count_; ++c, force += 3 * row) {
            const unsigned there = out[c] >> v % group & all;
            if (there == 0) continue;
            const auto more_x = hn::Add(x, hn::LoadU(d, force));
            const auto more_y = hn::Add(y, hn::LoadU(d, force + row));
            const auto more_z = hn::Add(z, hn::LoadU(d, force + 2 * row));
            replace(there, more_x, more_y, more_z, x, y, z);
        }
    }
    HWY_INLINE static void replace(unsigned there, WideVector new_x, WideVector new_y, WideVector new_z, WideVector& x,
                                   WideVector& y, WideVector& z) {
        if (there == all) {
            x = new_x;
            y = new_y;
            z = new_z;
            return;
        }
        const auto bits = static_cast<std::uint8_t>(there);
        const auto mask = hn::LoadMaskBits(Wide(), &bits);
        x = hn::IfThenElse(mask, new_x, x);
        y = hn::IfThenElse(mask, new_y, y);
        z = hn::IfThenElse(mask, new_z, z);
    }

    double h_;
    SpringStencil* stencil_;
    TissueState* state_;
    std::size_t query_distance_, count_;
    double* work_;
    std::size_t start_ = 0;  ///< vertex at column `query_distance_` of the window
    std::size_t taken_ = 0;  ///< vertices before this one are in the window
    WideVector furthest_ = hn::Zero(Wide());
    WideVector not_finite_ = hn::Zero(Wide());  // a finite number times zero is zero; infinities and NaN give NaN
};

#endif

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
