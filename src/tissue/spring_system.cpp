// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "tissue/spring_system.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tissue/spring_system.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "geometry/simd_targets.hpp"
#include "tissue/four_points-inl.hpp"
#include "tissue/lagged_factor.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

/// Entries of one spring in the system, and its part of the right side.
HWY_INLINE void linearise_one(double h, const SpringArrays& springs, std::size_t s, const TissueState& state,
                              SpringSystem& system) {
    const auto i = static_cast<std::size_t>(springs.i[s]);
    const auto j = static_cast<std::size_t>(springs.j[s]);
    const double* const xi = column(state.position, i);
    const double* const xj = column(state.position, j);
    const double* const vi = column(state.velocity, i);
    const double* const vj = column(state.velocity, j);
    const double d[3] = {xj[0] - xi[0], xj[1] - xi[1], xj[2] - xi[2]};
    // Fixed vertices keep their position in the step, whatever their velocity is.
    const double mi = state.inverse_mass[i] != 0.0 ? 1.0 : 0.0;
    const double mj = state.inverse_mass[j] != 0.0 ? 1.0 : 0.0;
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const double inverse = length == 0.0 ? 0.0 : 1.0 / length;
    const double u[3] = {d[0] * inverse, d[1] * inverse, d[2] * inverse};
    const double tension = length == 0.0 ? 0.0 : springs.k[s] * length + springs.offset[s];
    const double beta = std::max(0.0, h * h * tension * inverse);
    const double alpha = length == 0.0 ? 0.0 : h * (springs.damping[s] + h * springs.k[s]) - beta;
    system.x[s] = u[0];
    system.y[s] = u[1];
    system.z[s] = u[2];
    system.alpha[s] = alpha;
    system.beta[s] = beta;
    double closing = 0.0;
    double opening = 0.0;  // m/s, with fixed ends at rest
    for (int axis = 0; axis < 3; ++axis) {
        closing += (vj[axis] - vi[axis]) * u[axis];
        opening += (mj * vj[axis] - mi * vi[axis]) * u[axis];
    }
    const double along = h * (tension + springs.damping[s] * closing) + (h * h * springs.k[s] - beta) * opening;
    double* const bi = column(system.right_side, i);
    double* const bj = column(system.right_side, j);
    for (int axis = 0; axis < 3; ++axis) {
        const double push = along * u[axis] + beta * (mj * vj[axis] - mi * vi[axis]);
        bi[axis] += push;
        bj[axis] -= push;
    }
}

HWY_INLINE void multiply_one(const SpringArrays& springs, std::size_t s, const SpringSystem& system,
                             const Matrix4X& vector, Matrix4X& result) {
    const auto i = static_cast<std::size_t>(springs.i[s]);
    const auto j = static_cast<std::size_t>(springs.j[s]);
    const double* const vi = column(vector, i);
    const double* const vj = column(vector, j);
    const double d[3] = {vj[0] - vi[0], vj[1] - vi[1], vj[2] - vi[2]};
    const double along = system.alpha[s] * (d[0] * system.x[s] + d[1] * system.y[s] + d[2] * system.z[s]);
    const double u[3] = {system.x[s], system.y[s], system.z[s]};
    double* const ri = column(result, i);
    double* const rj = column(result, j);
    for (int axis = 0; axis < 3; ++axis) {
        const double push = along * u[axis] + system.beta[s] * d[axis];
        ri[axis] -= push;
        rj[axis] += push;
    }
}

#if HWY_MAX_BYTES >= 32

HWY_INLINE void add_to(double* to, Vector by) {
    const Four d;
    hn::StoreU(hn::Add(hn::LoadU(d, to), by), d, to);
}

HWY_INLINE void take_from(double* to, Vector by) {
    const Four d;
    hn::StoreU(hn::Sub(hn::LoadU(d, to), by), d, to);
}

void multiply_springs(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& vector,
                      Matrix4X& result) {
    const Four d;
    const double* const from = vector.data();
    double* const to = result.data();
    const Index* const i = springs.i.data();
    const Index* const j = springs.j.data();
    const auto spot = [](Index local) HWY_ATTR { return 4 * static_cast<std::ptrdiff_t>(local); };
    const auto between = [&](std::size_t s) HWY_ATTR {
        return hn::Sub(hn::LoadU(d, from + spot(j[s])), hn::LoadU(d, from + spot(i[s])));
    };
    std::size_t s = 0;
    for (; s + 4 <= springs.size(); s += 4) {
        Vector dx, dy, dz;
        transpose(between(s), between(s + 1), between(s + 2), between(s + 3), dx, dy, dz);
        const auto x = hn::LoadU(d, system.x.data() + s);
        const auto y = hn::LoadU(d, system.y.data() + s);
        const auto z = hn::LoadU(d, system.z.data() + s);
        const auto dot = hn::Add(hn::Add(hn::Mul(dx, x), hn::Mul(dy, y)), hn::Mul(dz, z));
        const auto along = hn::Mul(hn::LoadU(d, system.alpha.data() + s), dot);
        const auto beta = hn::LoadU(d, system.beta.data() + s);
        Vector p0, p1, p2, p3;
        transpose_back(hn::Add(hn::Mul(along, x), hn::Mul(beta, dx)), hn::Add(hn::Mul(along, y), hn::Mul(beta, dy)),
                       hn::Add(hn::Mul(along, z), hn::Mul(beta, dz)), p0, p1, p2, p3);
        take_from(to + spot(i[s]), p0);
        add_to(to + spot(j[s]), p0);
        take_from(to + spot(i[s + 1]), p1);
        add_to(to + spot(j[s + 1]), p1);
        take_from(to + spot(i[s + 2]), p2);
        add_to(to + spot(j[s + 2]), p2);
        take_from(to + spot(i[s + 3]), p3);
        add_to(to + spot(j[s + 3]), p3);
    }
    for (; s < springs.size(); ++s) multiply_one(springs, s, system, vector, result);
}

#else

void multiply_springs(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& vector,
                      Matrix4X& result) {
    for (std::size_t s = 0; s < springs.size(); ++s) multiply_one(springs, s, system, vector, result);
}

#endif

#if HWY_MAX_BYTES >= 32

/// Sum of the first three lanes, in the order of the version without vectors.
HWY_INLINE double sum_of_axes(Vector sums) {
    const Four d;
    double lanes[4];
    hn::StoreU(sums, d, lanes);
    return (lanes[0] + lanes[1]) + lanes[2];
}

HWY_INLINE void scale_by_inertia(const SpringSystem& system, const Matrix4X& vector, Matrix4X& result) {
    const Four d;
    const std::size_t count = system.inertia.size();
    for (std::size_t v = 0; v < count; ++v) {
        hn::StoreU(hn::Mul(hn::Set(d, system.inertia[v]), hn::LoadU(d, column(vector, v))), d, column(result, v));
    }
}

HWY_INLINE double close_rows(const SpringSystem& system, const Matrix4X& vector, Matrix4X& result) {
    const Four d;
    const std::size_t count = system.inertia.size();
    auto sums = hn::Zero(d);
    for (std::size_t v = 0; v < count; ++v) {
        auto row = hn::LoadU(d, column(result, v));
        if (system.inertia[v] == 0.0) {
            row = hn::Zero(d);
            hn::StoreU(row, d, column(result, v));
        }
        sums = hn::Add(sums, hn::Mul(hn::LoadU(d, column(vector, v)), row));
    }
    return sum_of_axes(sums);
}

double advance(const SpringSystem& system, double step, Matrix4X& solution, GradientVectors& vectors) {
    const Four d;
    const auto by = hn::Set(d, step);
    auto sums = hn::Zero(d);
    const std::size_t count = system.inertia.size();
    for (std::size_t v = 0; v < count; ++v) {
        double* const solved = column(solution, v);
        hn::StoreU(hn::Add(hn::LoadU(d, solved), hn::Mul(by, hn::LoadU(d, column(vectors.direction, v)))), d, solved);
        double* const residual = column(vectors.residual, v);
        const auto left = hn::Sub(hn::LoadU(d, residual), hn::Mul(by, hn::LoadU(d, column(vectors.image, v))));
        hn::StoreU(left, d, residual);
        const double* const inverse = system.inverse.data() + 12 * v;
        const auto better = hn::Add(hn::Add(hn::Mul(hn::LoadU(d, inverse), hn::Set(d, residual[0])),
                                            hn::Mul(hn::LoadU(d, inverse + 4), hn::Set(d, residual[1]))),
                                    hn::Mul(hn::LoadU(d, inverse + 8), hn::Set(d, residual[2])));
        hn::StoreU(better, d, column(vectors.preconditioned, v));
        sums = hn::Add(sums, hn::Mul(left, better));
    }
    return sum_of_axes(sums);
}

void turn(double ratio, GradientVectors& vectors) {
    const Four d;
    const auto by = hn::Set(d, ratio);
    const auto count = static_cast<std::size_t>(vectors.direction.cols());
    for (std::size_t v = 0; v < count; ++v) {
        double* const direction = column(vectors.direction, v);
        hn::StoreU(hn::Add(hn::LoadU(d, column(vectors.preconditioned, v)), hn::Mul(by, hn::LoadU(d, direction))), d,
                   direction);
    }
}

#else

HWY_INLINE void scale_by_inertia(const SpringSystem& system, const Matrix4X& vector, Matrix4X& result) {
    for (std::size_t v = 0; v < system.inertia.size(); ++v) {
        for (int axis = 0; axis < 4; ++axis) column(result, v)[axis] = system.inertia[v] * column(vector, v)[axis];
    }
}

HWY_INLINE double close_rows(const SpringSystem& system, const Matrix4X& vector, Matrix4X& result) {
    double sums[3] = {0.0, 0.0, 0.0};
    for (std::size_t v = 0; v < system.inertia.size(); ++v) {
        double* const row = column(result, v);
        if (system.inertia[v] == 0.0) std::fill_n(row, 4, 0.0);
        for (int axis = 0; axis < 3; ++axis) sums[axis] += column(vector, v)[axis] * row[axis];
    }
    return (sums[0] + sums[1]) + sums[2];
}

double advance(const SpringSystem& system, double step, Matrix4X& solution, GradientVectors& vectors) {
    double sums[3] = {0.0, 0.0, 0.0};
    for (std::size_t v = 0; v < system.inertia.size(); ++v) {
        double* const residual = column(vectors.residual, v);
        for (int axis = 0; axis < 4; ++axis) {
            column(solution, v)[axis] += step * column(vectors.direction, v)[axis];
            residual[axis] -= step * column(vectors.image, v)[axis];
        }
        const double* const inverse = system.inverse.data() + 12 * v;
        double* const better = column(vectors.preconditioned, v);
        for (int axis = 0; axis < 4; ++axis) {
            better[axis] =
                (inverse[axis] * residual[0] + inverse[4 + axis] * residual[1]) + inverse[8 + axis] * residual[2];
        }
        for (int axis = 0; axis < 3; ++axis) sums[axis] += residual[axis] * better[axis];
    }
    return (sums[0] + sums[1]) + sums[2];
}

void turn(double ratio, GradientVectors& vectors) {
    vectors.direction = vectors.preconditioned + ratio * vectors.direction;
}

#endif

double multiply(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& vector, Matrix4X& result) {
    scale_by_inertia(system, vector, result);
    multiply_springs(springs, system, vector, result);
    return close_rows(system, vector, result);
}

/// Inverts the diagonal blocks of A.
void invert_blocks(const SpringArrays& springs, SpringSystem& system) {
    for (std::size_t v = 0; v < system.inertia.size(); ++v) {
        double* const inverse = system.inverse.data() + 12 * v;
        if (system.inertia[v] == 0.0) {
            std::fill_n(inverse, 12, 0.0);
            continue;
        }
        double xx = system.inertia[v];
        double yy = system.inertia[v];
        double zz = system.inertia[v];
        double xy = 0.0;
        double xz = 0.0;
        double yz = 0.0;
        const auto add = [&](std::size_t s) HWY_ATTR {
            const double x = system.alpha[s] * system.x[s];
            const double y = system.alpha[s] * system.y[s];
            xx += x * system.x[s] + system.beta[s];
            yy += y * system.y[s] + system.beta[s];
            zz += system.alpha[s] * system.z[s] * system.z[s] + system.beta[s];
            xy += x * system.y[s];
            xz += x * system.z[s];
            yz += y * system.z[s];
        };
        for (std::size_t s = springs.first_out[v]; s < springs.first_out[v + 1]; ++s) add(s);
        for (std::uint32_t e = springs.first_in[v]; e < springs.first_in[v + 1]; ++e) add(springs.in[e]);
        const double cxx = yy * zz - yz * yz;
        const double cxy = xz * yz - xy * zz;
        const double cxz = xy * yz - xz * yy;
        const double scale = 1.0 / (xx * cxx + xy * cxy + xz * cxz);
        const double rows[3][3] = {
            {cxx, cxy, cxz}, {cxy, xx * zz - xz * xz, xy * xz - xx * yz}, {cxz, xy * xz - xx * yz, xx * yy - xy * xy}};
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t r = 0; r < 3; ++r) inverse[4 * c + r] = scale * rows[c][r];
            inverse[4 * c + 3] = 0.0;
        }
    }
}

void linearise(double h, const SpringArrays& springs, const TissueState& state, SpringSystem& system) {
    for (std::size_t v = 0; v < state.size(); ++v) {
        const bool moves = state.inverse_mass[v] != 0.0;
        system.inertia[v] = moves ? 1.0 / state.inverse_mass[v] + h * state.drag[v] : 0.0;
        double* const right = column(system.right_side, v);
        const double* const constant = column(state.constant, v);
        const double* const velocity = column(state.velocity, v);
        for (int axis = 0; axis < 4; ++axis) {
            right[axis] = moves ? h * (constant[axis] - state.drag[v] * velocity[axis]) : 0.0;
        }
    }
    for (std::size_t s = 0; s < springs.size(); ++s) linearise_one(h, springs, s, state, system);
    for (std::size_t v = 0; v < state.size(); ++v) {
        if (system.inertia[v] == 0.0) std::fill_n(column(system.right_side, v), 4, 0.0);
    }
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(linearise);
HWY_EXPORT(invert_blocks);
HWY_EXPORT(multiply);
HWY_EXPORT(advance);
HWY_EXPORT(turn);

const std::vector<SystemKernels>& system_kernels() {
    static const std::vector<SystemKernels> kernels = versions_by_target([](const char* target) {
        return SystemKernels{.linearise = &HWY_DYNAMIC_DISPATCH(linearise),
                             .invert_blocks = &HWY_DYNAMIC_DISPATCH(invert_blocks),
                             .multiply = &HWY_DYNAMIC_DISPATCH(multiply),
                             .advance = &HWY_DYNAMIC_DISPATCH(advance),
                             .turn = &HWY_DYNAMIC_DISPATCH(turn),
                             .target = target};
    });
    return kernels;
}

SpringSystem::SpringSystem(std::size_t spring_count, std::size_t vertex_count) {
    for (std::vector<double>* array : {&x, &y, &z, &alpha, &beta}) array->assign(spring_count, 0.0);
    inertia.assign(vertex_count, 0.0);
    inverse.assign(12 * vertex_count, 0.0);
    right_side.setZero(4, static_cast<Eigen::Index>(vertex_count));
}

ConjugateGradients::ConjugateGradients(std::size_t vertex_count) : kernels_(&system_kernels().front()) {
    for (Matrix4X* vector : {&vectors_.residual, &vectors_.preconditioned, &vectors_.direction, &vectors_.image}) {
        vector->setZero(4, static_cast<Eigen::Index>(vertex_count));
    }
}

/// image = A direction; returns direction · image.
double ConjugateGradients::multiply(const SpringArrays& springs, const SpringSystem& system) {
    return kernels_->multiply(springs, system, vectors_.direction, vectors_.image);
}

bool ConjugateGradients::has_factor() const { return factor_ != nullptr && factor_->is_ready(); }

/// As the kernel of this name; a ready factor replaces the block preconditioner.
double ConjugateGradients::advance(const SpringSystem& system, double step, Matrix4X& solution) {
    const double product = kernels_->advance(system, step, solution, vectors_);
    if (!has_factor()) return product;
    return factor_->precondition(system, vectors_.residual, vectors_.preconditioned);
}

/// Returns the product of the right side and the preconditioned right side.
double ConjugateGradients::start_from_nothing(const SpringSystem& system, const Matrix4X& right_side,
                                              Matrix4X& solution) {
    // setZero, because scaling by zero would keep non-finite numbers.
    for (Matrix4X* vector : {&solution, &vectors_.direction, &vectors_.image}) vector->setZero();
    vectors_.residual = right_side;
    return advance(system, 0.0, solution);
}

int ConjugateGradients::solve(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& right_side,
                              double tolerance, int iterations, Matrix4X& solution) {
    const double rho = start_from_nothing(system, right_side, solution);
    return iterate(springs, system, rho, tolerance * tolerance * rho, iterations, solution);
}

int ConjugateGradients::improve(const SpringArrays& springs, const SpringSystem& system, const Matrix4X& right_side,
                                double tolerance, int iterations, Matrix4X& solution, double size) {
    vectors_.direction = solution;
    for (std::size_t v = 0; v < system.inertia.size(); ++v) {
        if (system.inertia[v] == 0.0) vectors_.direction.col(static_cast<Eigen::Index>(v)).setZero();
    }
    solution.setZero();
    vectors_.image.setZero();
    vectors_.residual = right_side;
    double own = has_factor() ? 0.0 : advance(system, 0.0, solution);
    const double curvature = multiply(springs, system);
    double rho = advance(system, 1.0, solution);
    // With b = r + A x and P the inverse of the factor: b·Pb = r·Pr + 2 Ax·Pr + Ax·P(Ax). The last term is approximated
    // by x·Ax, since P approximates A⁻¹; its exact value would cost about an iteration.
    if (has_factor()) own = rho + 2.0 * vectors_.image.cwiseProduct(vectors_.preconditioned).sum() + curvature;
    if (!(rho < own)) own = rho = start_from_nothing(system, right_side, solution);
    size_ = std::max(own, size);
    return iterate(springs, system, rho, tolerance * tolerance * size_, iterations, solution);
}

/// Iterates from the residual and preconditioned residual, whose product is `rho`, until the product is at most
/// `small`.
int ConjugateGradients::iterate(const SpringArrays& springs, const SpringSystem& system, double rho, double small,
                                int iterations, Matrix4X& solution) {
    kernels_->turn(0.0, vectors_);
    int taken = 0;
    while (taken < iterations && rho > small) {
        ++taken;
        const double curvature = multiply(springs, system);
        if (!(curvature > 0.0)) break;
        const double next = advance(system, rho / curvature, solution);
        kernels_->turn(next / rho, vectors_);
        rho = next;
    }
    return taken;
}

}  // namespace trocar
#endif
