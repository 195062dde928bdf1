// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "tissue/compliance.hpp"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tissue/compliance.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Some = hn::CappedTag<double, compliance_lanes>;

/// Offset of a vertex: x, y and z, compliance_lanes numbers each.
HWY_INLINE std::size_t begin_of(std::size_t vertex) { return 3 * compliance_lanes * vertex; }

HWY_INLINE void multiply_spring(const SpringSystem& system, std::uint32_t spring, std::size_t a, std::size_t b,
                                const double* from, double* to) {
    const Some d;
    const auto x = hn::Set(d, system.x[spring]);
    const auto y = hn::Set(d, system.y[spring]);
    const auto z = hn::Set(d, system.z[spring]);
    const auto alpha = hn::Set(d, system.alpha[spring]);
    const auto beta = hn::Set(d, system.beta[spring]);
    for (std::size_t lane = 0; lane < compliance_lanes; lane += hn::Lanes(d)) {
        const auto between = [&](std::size_t axis) HWY_ATTR {
            const std::size_t offset = axis * compliance_lanes + lane;
            return hn::Sub(hn::LoadU(d, from + a + offset), hn::LoadU(d, from + b + offset));
        };
        const auto dx = between(0);
        const auto dy = between(1);
        const auto dz = between(2);
        const auto dot = hn::Add(hn::Add(hn::Mul(dx, x), hn::Mul(dy, y)), hn::Mul(dz, z));
        const auto along = hn::Mul(alpha, dot);
        const auto push = [&](std::size_t axis, auto direction, auto difference) HWY_ATTR {
            const std::size_t offset = axis * compliance_lanes + lane;
            const auto by = hn::Add(hn::Mul(along, direction), hn::Mul(beta, difference));
            hn::StoreU(hn::Add(hn::LoadU(d, to + a + offset), by), d, to + a + offset);
            hn::StoreU(hn::Sub(hn::LoadU(d, to + b + offset), by), d, to + b + offset);
        };
        push(0, x, dx);
        push(1, y, dy);
        push(2, z, dz);
    }
}

Lanes multiply(const SpringSystem& system, std::size_t inner, std::size_t reached, std::size_t spring_count,
               ReachedTissue& tissue) {
    const Some d;
    const double* const from = tissue.direction.data();
    double* const to = tissue.image.data();
    for (std::size_t v = 0; v < reached; ++v) {
        const auto inertia = hn::Set(d, system.inertia[static_cast<std::size_t>(tissue.vertices[v])]);
        for (std::size_t n = begin_of(v); n < begin_of(v + 1); n += hn::Lanes(d)) {
            hn::StoreU(hn::Mul(inertia, hn::LoadU(d, from + n)), d, to + n);
        }
    }
    for (std::size_t s = 0; s < spring_count; ++s) {
        multiply_spring(system, tissue.springs[s], begin_of(tissue.ends[s][0]), begin_of(tissue.ends[s][1]), from, to);
    }
    Lanes sums{};
    for (std::size_t n = 0; n < begin_of(inner); n += compliance_lanes) {
        for (std::size_t lane = 0; lane < compliance_lanes; lane += hn::Lanes(d)) {
            const auto product = hn::Mul(hn::LoadU(d, from + n + lane), hn::LoadU(d, to + n + lane));
            hn::StoreU(hn::Add(hn::LoadU(d, sums.data() + lane), product), d, sums.data() + lane);
        }
    }
    return sums;
}

Lanes advance(const SpringSystem& system, const Lanes& step, std::size_t inner, std::size_t reached,
              ReachedTissue& tissue) {
    const Some d;
    Lanes sums{};
    for (std::size_t v = 0; v < reached; ++v) {
        const double* const inverse = system.inverse.data() + 12 * static_cast<std::size_t>(tissue.vertices[v]);
        for (std::size_t lane = 0; lane < compliance_lanes; lane += hn::Lanes(d)) {
            const auto by = hn::LoadU(d, step.data() + lane);
            const std::size_t n = begin_of(v) + lane;
            const auto left = [&](std::size_t axis) HWY_ATTR {
                const std::size_t at = n + axis * compliance_lanes;
                if (v < inner) {
                    const auto along = hn::Mul(by, hn::LoadU(d, tissue.direction.data() + at));
                    hn::StoreU(hn::Add(hn::LoadU(d, tissue.solution.data() + at), along), d,
                               tissue.solution.data() + at);
                }
                const auto taken = hn::Mul(by, hn::LoadU(d, tissue.image.data() + at));
                const auto residual = hn::Sub(hn::LoadU(d, tissue.residual.data() + at), taken);
                hn::StoreU(residual, d, tissue.residual.data() + at);
                return residual;
            };
            const auto x = left(0);
            const auto y = left(1);
            const auto z = left(2);
            auto sum = hn::LoadU(d, sums.data() + lane);
            const auto put = [&](std::size_t axis, auto residual) HWY_ATTR {
                const auto better =
                    hn::Add(hn::Add(hn::Mul(hn::Set(d, inverse[axis]), x), hn::Mul(hn::Set(d, inverse[4 + axis]), y)),
                            hn::Mul(hn::Set(d, inverse[8 + axis]), z));
                hn::StoreU(better, d, tissue.preconditioned.data() + n + axis * compliance_lanes);
                sum = hn::Add(sum, hn::Mul(residual, better));
            };
            put(0, x);
            put(1, y);
            put(2, z);
            hn::StoreU(sum, d, sums.data() + lane);
        }
    }
    return sums;
}

void turn(const Lanes& ratio, std::size_t reached, ReachedTissue& tissue) {
    const Some d;
    for (std::size_t n = 0; n < begin_of(reached); n += compliance_lanes) {
        for (std::size_t lane = 0; lane < compliance_lanes; lane += hn::Lanes(d)) {
            const auto old =
                hn::Mul(hn::LoadU(d, ratio.data() + lane), hn::LoadU(d, tissue.direction.data() + n + lane));
            hn::StoreU(hn::Add(hn::LoadU(d, tissue.preconditioned.data() + n + lane), old), d,
                       tissue.direction.data() + n + lane);
        }
    }
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(multiply);
HWY_EXPORT(advance);
HWY_EXPORT(turn);

const std::vector<ComplianceKernels>& compliance_kernels() {
    static const std::vector<ComplianceKernels> kernels = versions_by_target([](const char* target) {
        return ComplianceKernels{.multiply = &HWY_DYNAMIC_DISPATCH(multiply),
                                 .advance = &HWY_DYNAMIC_DISPATCH(advance),
                                 .turn = &HWY_DYNAMIC_DISPATCH(turn),
                                 .target = target};
    });
    return kernels;
}

namespace {

constexpr std::size_t per_vertex = 3 * compliance_lanes;

std::array<std::vector<double>*, 5> vectors(ReachedTissue& tissue) {
    return {&tissue.solution, &tissue.residual, &tissue.preconditioned, &tissue.direction, &tissue.image};
}

}  // namespace

Compliance::Compliance(std::size_t spring_count, std::size_t vertex_count)
    : kernels_(&compliance_kernels().front()), number_(vertex_count, -1), is_in_(spring_count, 0) {
    tissue_.vertices.reserve(vertex_count);
    tissue_.springs.reserve(spring_count);
    tissue_.ends.reserve(spring_count);
    tissue_.ring_end.reserve(vertex_count + 1);
    tissue_.spring_end.reserve(vertex_count + 1);
    for (std::vector<double>* array : vectors(tissue_)) array->reserve(per_vertex * vertex_count);
}

void Compliance::begin(const SpringArrays& springs, const SpringSystem& system, std::span<const Index> touched) {
    for (const Index v : tissue_.vertices) number_[at(v)] = -1;
    for (const std::uint32_t s : tissue_.springs) is_in_[s] = 0;
    springs_ = &springs;
    system_ = &system;
    tissue_.vertices.assign(touched.begin(), touched.end());
    for (std::size_t n = 0; n < touched.size(); ++n) number_[at(touched[n])] = static_cast<Index>(n);
    tissue_.ring_end.assign(1, touched.size());
    tissue_.springs.clear();
    tissue_.ends.clear();
    tissue_.spring_end.clear();
    used_ = 0;
    for (std::vector<double>* array : vectors(tissue_)) {
        array->assign(per_vertex * touched.size(), 0.0);
    }
}

/// Adds the next ring.
void Compliance::grow() {
    const std::size_t first = tissue_.ring_end.size() > 1 ? tissue_.ring_end[tissue_.ring_end.size() - 2] : 0;
    const std::size_t end = tissue_.ring_end.back();
    const auto query_distance = [&](Index v) {
        if (number_[at(v)] < 0) {
            number_[at(v)] = static_cast<Index>(tissue_.vertices.size());
            tissue_.vertices.push_back(v);
        }
        return static_cast<std::uint32_t>(number_[at(v)]);
    };
    const auto take = [&](std::uint32_t s) {
        if (is_in_[s] != 0) return;
        is_in_[s] = 1;
        tissue_.springs.push_back(s);
        tissue_.ends.push_back({query_distance(springs_->i[s]), query_distance(springs_->j[s])});
    };
    for (std::size_t n = first; n < end; ++n) {
        const std::size_t v = at(tissue_.vertices[n]);
        if (system_->inertia[v] == 0.0) continue;  // fixed: transmits nothing
        for (std::uint32_t s = springs_->first_out[v]; s < springs_->first_out[v + 1]; ++s) take(s);
        for (std::uint32_t e = springs_->first_in[v]; e < springs_->first_in[v + 1]; ++e) take(springs_->in[e]);
    }
    tissue_.spring_end.push_back(tissue_.springs.size());
    tissue_.ring_end.push_back(tissue_.vertices.size());
    for (std::vector<double>* array : vectors(tissue_)) {
        array->resize(per_vertex * tissue_.vertices.size(), 0.0);
    }
}

void Compliance::clear() {
    for (std::vector<double>* array : vectors(tissue_)) {
        std::fill_n(array->begin(), per_vertex * used_, 0.0);
    }
    used_ = tissue_.ring_end.front();
}

void Compliance::add(std::size_t lane, Index spot, const Vector3& impulse) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        tissue_.residual[per_vertex * at(spot) + axis * compliance_lanes + lane] +=
            impulse[static_cast<Eigen::Index>(axis)];
    }
}

void Compliance::solve(double tolerance, int iterations) {
    const std::size_t start = tissue_.ring_end.front();
    Lanes rho = kernels_->advance(*system_, Lanes{}, start, start, tissue_);
    Lanes small = rho;
    for (double& number : small) number *= tolerance * tolerance;
    kernels_->turn(Lanes{}, start, tissue_);
    for (int iteration = 0; iteration < iterations; ++iteration) {
        bool done = true;
        for (std::size_t lane = 0; lane < compliance_lanes; ++lane) done = done && rho[lane] <= small[lane];
        if (done) break;
        const auto ring = static_cast<std::size_t>(iteration);
        while (tissue_.spring_end.size() <= ring) grow();
        const std::size_t inner = tissue_.ring_end[ring];
        const std::size_t reached = tissue_.ring_end[ring + 1];
        used_ = std::max(used_, reached);
        const Lanes curvature = kernels_->multiply(*system_, inner, reached, tissue_.spring_end[ring], tissue_);
        Lanes step{};
        for (std::size_t lane = 0; lane < compliance_lanes; ++lane) {
            // A converged or empty lane does not change.
            if (rho[lane] > small[lane] && curvature[lane] > 0.0) step[lane] = rho[lane] / curvature[lane];
        }
        const Lanes next = kernels_->advance(*system_, step, inner, reached, tissue_);
        Lanes ratio{};
        for (std::size_t lane = 0; lane < compliance_lanes; ++lane) {
            if (step[lane] == 0.0) continue;
            ratio[lane] = next[lane] / rho[lane];
            rho[lane] = next[lane];
        }
        kernels_->turn(ratio, reached, tissue_);
    }
}

Vector3 Compliance::answer(std::size_t lane, Index spot) const {
    Vector3 result;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        result[static_cast<Eigen::Index>(axis)] =
            tissue_.solution[per_vertex * at(spot) + axis * compliance_lanes + lane];
    }
    return result;
}

}  // namespace trocar
#endif
