#include "tissue/hinge_kernels.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tissue/shape_forces.hpp"

namespace trocar {
namespace {

TEST(HingeKernels, EveryVersionAddsTheForcesOfTheObviousFormToTheBit) {
    // 43 hinges between 30 vertices: vectors of four and what is left over, vertices shared within a vector, rest
    // angles next to a half turn, a triangle without area.
    constexpr Index vertices = 30;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const Matrix3X position = Matrix3X::NullaryExpr(3, vertices, [&] { return unit(random); });
    const Matrix3X start = Matrix3X::NullaryExpr(3, vertices, [&] { return unit(random); });
    std::vector<Index> order(vertices);
    std::iota(order.begin(), order.end(), 0);
    std::vector<Hinge> hinges;
    while (hinges.size() < 43) {
        std::shuffle(order.begin(), order.end(), random);
        hinges.push_back({.vertex = {order[0], order[1], order[2], order[3]},
                          .rest = 3.1 * unit(random),
                          .stiffness = 1.0 + unit(random)});
    }
    hinges[6].vertex[2] = hinges[6].vertex[1];
    hinges[42].vertex[3] = hinges[42].vertex[0];
    Matrix3X expected = start;
    add_shape_force({.stiffening = {}, .hinges = hinges, .enclosures = {}}, position, expected);
    const auto padded = [](const Matrix3X& of) {
        Matrix4X result = Matrix4X::Zero(4, of.cols());
        result.topRows<3>() = of;
        return result;
    };
    const HingeArrays arrays = hinge_arrays(hinges);
    ASSERT_EQ(arrays.size(), hinges.size());
    Matrix4X first;
    for (const HingeKernels& kernels : hinge_kernels()) {
        Matrix4X force = padded(start);
        kernels.add_forces(arrays, padded(position), force);
        EXPECT_LT((force.topRows<3>() - expected).norm(), 1e-13 * expected.norm()) << kernels.target;
        EXPECT_EQ(force.row(3).cwiseAbs().maxCoeff(), 0.0);
        if (first.size() == 0) first = force;
        EXPECT_EQ(first, force) << kernels.target << " differs in a bit";
    }
    EXPECT_GT(hinge_kernels().size(), 1U) << "or nothing is compared";
}

}  // namespace
}  // namespace trocar
