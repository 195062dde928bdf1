// Compiled once per instruction set by Highway, which includes this file again for each of them.
#include "tissue/system_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tissue/system_kernels.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h must come first
#include <hwy/highway.h>

#include "geometry/simd_targets.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::HWY_NAMESPACE {

#if HWY_MAX_BYTES >= 32

namespace hn = hwy::HWY_NAMESPACE;
const hn::FixedTag<double, 4> four;
using Four = hn::Vec<decltype(four)>;

HWY_INLINE Four load(const double* from) { return hn::LoadU(four, from); }
HWY_INLINE void store(Four number, double* to) { hn::StoreU(number, four, to); }
HWY_INLINE Four all(double number) { return hn::Set(four, number); }
HWY_INLINE Four load_column(const float* from) {
    const hn::FixedTag<float, 4> narrow;
    return hn::PromoteTo(four, hn::LoadU(narrow, from));
}
HWY_INLINE Four add(Four a, Four b) { return hn::Add(a, b); }
HWY_INLINE Four sub(Four a, Four b) { return hn::Sub(a, b); }
HWY_INLINE Four mul(Four a, Four b) { return hn::Mul(a, b); }

#else

struct Four {
    double number[4];
};

template <typename Act>
HWY_INLINE Four each(const Act& act) {
    return {{act(0), act(1), act(2), act(3)}};
}
HWY_INLINE Four load(const double* from) {
    return each([from](int n) { return from[n]; });
}
HWY_INLINE void store(Four number, double* to) {
    for (int n = 0; n < 4; ++n) to[n] = number.number[n];
}
HWY_INLINE Four all(double number) {
    return each([number](int) { return number; });
}
HWY_INLINE Four load_column(const float* from) {
    return each([from](int n) { return static_cast<double>(from[n]); });
}
HWY_INLINE Four add(Four a, Four b) {
    return each([&](int n) { return a.number[n] + b.number[n]; });
}
HWY_INLINE Four sub(Four a, Four b) {
    return each([&](int n) { return a.number[n] - b.number[n]; });
}
HWY_INLINE Four mul(Four a, Four b) {
    return each([&](int n) { return a.number[n] * b.number[n]; });
}

#endif

HWY_INLINE double sum_of(Four number) {
    double lanes[4];
    store(number, lanes);
    return ((lanes[0] + lanes[1]) + lanes[2]) + lanes[3];
}

void multiply_edges(std::span<const SystemEdge> edges, const double* direction, double* image) {
    std::size_t e = 0;
    while (e < edges.size()) {
        // The sum over the edges of one node stays in a register.
        const Index own = edges[e].own;
        const std::size_t i = 4 * static_cast<std::size_t>(own);
        const Four here = load(direction + i);
        Four sum = load(image + i);
        do {
            const SystemEdge& edge = edges[e];
            const std::size_t j = 4 * static_cast<std::size_t>(edge.other);
            double apart[4];
            store(sub(here, load(direction + j)), apart);
            const Four along_x = mul(load_column(edge.block.data()), all(apart[0]));
            const Four along_y = mul(load_column(edge.block.data() + 4), all(apart[1]));
            const Four along_z = mul(load_column(edge.block.data() + 8), all(apart[2]));
            const Four push = add(add(along_x, along_y), along_z);
            sum = add(sum, push);
            store(sub(load(image + j), push), image + j);
        } while (++e < edges.size() && edges[e].own == own);
        store(sum, image + i);
    }
}

double improve_nodes(std::size_t count, double by, const double* direction, const double* image, const double* inverse,
                     double* change, double* residual, double* preconditioned) {
    const Four step = all(by);
    Four sum = all(0.0);
    for (std::size_t n = 0; n < 4 * count; n += 4) {
        store(add(load(change + n), mul(step, load(direction + n))), change + n);
        const Four left = sub(load(residual + n), mul(step, load(image + n)));
        store(left, residual + n);
        const double* const block = inverse + 3 * n;
        const Four answer = add(add(mul(load(block), all(residual[n])), mul(load(block + 4), all(residual[n + 1]))),
                                mul(load(block + 8), all(residual[n + 2])));
        store(answer, preconditioned + n);
        sum = add(sum, mul(left, answer));
    }
    return sum_of(sum);
}

void turn_direction(std::size_t count, double by, const double* preconditioned, const double* inertia,
                    double* direction, double* image) {
    const Four part = all(by);
    for (std::size_t n = 0; n < count; ++n) {
        const Four turned = add(load(preconditioned + 4 * n), mul(part, load(direction + 4 * n)));
        store(turned, direction + 4 * n);
        store(mul(all(inertia[n]), turned), image + 4 * n);
    }
}

double dot_product(std::size_t count, const double* a, const double* b) {
    Four sum = all(0.0);
    for (std::size_t n = 0; n < 4 * count; n += 4) sum = add(sum, mul(load(a + n), load(b + n)));
    return sum_of(sum);
}

}  // namespace trocar::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar {

HWY_EXPORT(multiply_edges);
HWY_EXPORT(improve_nodes);
HWY_EXPORT(turn_direction);
HWY_EXPORT(dot_product);

const std::vector<SystemKernels>& system_kernels() {
    static const std::vector<SystemKernels> kernels = versions_by_target([](const char* target) {
        return SystemKernels{.multiply = &HWY_DYNAMIC_DISPATCH(multiply_edges),
                             .improve = &HWY_DYNAMIC_DISPATCH(improve_nodes),
                             .turn = &HWY_DYNAMIC_DISPATCH(turn_direction),
                             .dot = &HWY_DYNAMIC_DISPATCH(dot_product),
                             .target = target};
    });
    return kernels;
}

}  // namespace trocar
#endif
