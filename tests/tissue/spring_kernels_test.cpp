#include "tissue/spring_kernels.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "support/random_vectors.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

/// Springs between random vertices, more than a vector holds and not a multiple of it, one of them of zero length.
struct Tangle {
    Materials materials;
    SpringArrays springs;
    TissueState state;
    Matrix3X position, velocity;

    Tangle() {
        constexpr Index vertices = 41;
        constexpr int count = 203;
        std::mt19937 random(7);
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        position = Matrix3X::NullaryExpr(3, vertices, [&] { return unit(random); });
        velocity = Matrix3X::NullaryExpr(3, vertices, [&] { return unit(random); });
        position.col(1) = position.col(0);
        for (int s = 0; s < count; ++s) {
            const Index i = s == 100 ? 0 : static_cast<Index>(random() % vertices);
            const Index j = s == 100 ? 1 : (i + 2 + static_cast<Index>(random() % (vertices - 4))) % vertices;
            const Spring spring{.i = i,
                                .j = j,
                                .rest = 0.5 + 0.1 * unit(random),
                                .k = 100.0 + unit(random),
                                .preload = unit(random),
                                .damping = 0.1 + 0.05 * unit(random)};
            materials.springs.push_back(spring);
        }
        std::vector<Index> place(vertices);
        std::iota(place.begin(), place.end(), 0);
        std::vector<Spring> sorted = materials.springs;
        springs = spring_arrays(sorted, place, vertices);
        const auto padded = [](const Matrix3X& of) {
            Matrix4X result = Matrix4X::Zero(4, of.cols());
            result.topRows<3>() = of;
            return result;
        };
        state.position = padded(position);
        state.velocity = padded(velocity);
        state.constant = padded(Matrix3X::NullaryExpr(3, vertices, [&] { return unit(random); }));
        for (Index v = 0; v < vertices; ++v) {
            state.vertex.push_back(v);
            state.inverse_mass.push_back(v % 5 == 0 ? 0.0 : 2.0 + unit(random));
            state.drag.push_back(1.0 + unit(random));
        }
    }
};

TEST(SpringKernels, EveryVersionStepsByTheSameForcesAsTheObviousForm) {
    const Tangle tangle;
    constexpr double h = 1e-2;
    Matrix3X force;
    internal_force(tangle.materials, tangle.position, tangle.velocity, force);
    force += tangle.state.constant.topRows<3>();
    Matrix4X first;
    for (const SpringKernels& kernels : spring_kernels()) {
        TissueState state = tangle.state;
        SpringArrays springs = tangle.springs;
        const SubStepCheck check = kernels.sub_step(h, springs, state);
        double furthest = 0.0;
        for (Index v = 0; v < static_cast<Index>(state.size()); ++v) {
            const auto i = static_cast<std::size_t>(v);
            const Vector3 before = tangle.velocity.col(v);
            const Vector3 all = force.col(v) - state.drag[i] * before;
            const Vector3 velocity = before + h * state.inverse_mass[i] * all;
            const Vector3 path = state.inverse_mass[i] == 0.0 ? Vector3(Vector3::Zero()) : Vector3(h * velocity);
            furthest = std::max(furthest, path.cwiseAbs().maxCoeff());
            EXPECT_LT((state.velocity.col(v).head<3>() - velocity).norm(), 1e-11) << kernels.target << ", " << v;
            EXPECT_LT((state.position.col(v).head<3>() - tangle.position.col(v) - path).norm(), 1e-13)
                << kernels.target;
        }
        EXPECT_TRUE(check.finite);
        EXPECT_NEAR(check.furthest, furthest, 1e-13);
        if (first.size() == 0) first = state.position;
        EXPECT_EQ(first.topRows<3>(), state.position.topRows<3>()) << kernels.target << " differs in a bit";
        state.velocity(1, 7) = std::numeric_limits<double>::quiet_NaN();
        EXPECT_FALSE(kernels.sub_step(h, springs, state).finite) << kernels.target;
    }
}

/// A sheet of rows with springs along, across and aslant, longer than the stencil's window, the last group of vertices
/// not full. Some springs are missing, some vertices are held, one spring has no length.
struct Rows {
    SpringArrays springs;
    TissueState state;

    Rows(Index rows, Index width) {
        std::mt19937 random(11);
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        const Index vertices = rows * width - 3;
        std::vector<Spring> all;
        for (Index v = 0; v < vertices; ++v) {
            for (const Index offset : {1, width, width + 1}) {
                const bool leaves_row = offset != width && v % width == width - 1;
                if (leaves_row || v + offset >= vertices || random() % 50 == 0) continue;
                all.push_back({.i = v,
                               .j = v + offset,
                               .rest = 1.0 + 0.1 * unit(random),
                               .k = 100.0 + unit(random),
                               .preload = unit(random),
                               .damping = 0.1 + 0.05 * unit(random)});
            }
            state.vertex.push_back(v);
            state.inverse_mass.push_back(v % 41 == 0 ? 0.0 : 2.0 + unit(random));
            state.drag.push_back(1.0 + unit(random));
        }
        std::vector<Index> place(static_cast<std::size_t>(vertices));
        std::iota(place.begin(), place.end(), 0);
        springs = spring_arrays(all, place, static_cast<std::size_t>(vertices));
        for (Matrix4X* array : {&state.position, &state.velocity, &state.constant}) array->setZero(4, vertices);
        for (Index v = 0; v < vertices; ++v) {
            const Vector3 place_of(v % width, v / width, 0.0);
            state.position.col(v).head<3>() = place_of + 0.2 * test::random_vector(unit, random);
            state.velocity.col(v).head<3>() = test::random_vector(unit, random);
            state.constant.col(v).head<3>() = test::random_vector(unit, random);
        }
        state.position.col(springs.j[70]) = state.position.col(springs.i[70]);
    }
};

TEST(SpringKernels, GoingByOffsetsChangesNoBitInAnyVersion) {
    for (const Index rows : {3, 160}) {
        const Rows sheet(rows, 61);
        TissueState plain = sheet.state;
        SpringArrays springs = sheet.springs;
        std::vector<SubStepCheck> checks;
        constexpr int steps = 3;
        constexpr double h = 1e-2;
        for (int step = 0; step < steps; ++step) {
            checks.push_back(spring_kernels().back().sub_step(h, springs, plain));
        }
        springs.stencil = spring_stencil(springs);
        ASSERT_EQ(springs.stencil.offsets, (std::vector<std::size_t>{1, 61, 62}));
        for (const SpringKernels& kernels : spring_kernels()) {
            SCOPED_TRACE(kernels.target);
            TissueState state = sheet.state;
            for (int step = 0; step < steps; ++step) {
                const SubStepCheck check = kernels.sub_step(h, springs, state);
                EXPECT_EQ(check.furthest, checks[static_cast<std::size_t>(step)].furthest);
                EXPECT_TRUE(check.finite);
            }
            EXPECT_EQ(state.position, plain.position);
            EXPECT_EQ(state.velocity, plain.velocity);
            state.velocity(2, 100) = std::numeric_limits<double>::infinity();
            EXPECT_FALSE(kernels.sub_step(h, springs, state).finite);
        }
    }
}

TEST(SpringKernels, SpringsThatDoNotRepeatHaveNoStencil) {
    EXPECT_TRUE(spring_stencil(Tangle().springs).empty()) << "offsets of the springs of a vertex do not ascend";
    // Few springs of each offset, far apart: most of what vectors would compute is for nothing.
    std::vector<Spring> sparse;
    for (Index v = 0; v + 20 < 400; v += 8) sparse.push_back({.i = v, .j = v + 1 + v / 8 % 20, .rest = 1.0, .k = 1.0});
    std::vector<Index> place(400);
    std::iota(place.begin(), place.end(), 0);
    EXPECT_TRUE(spring_stencil(spring_arrays(sparse, place, 400)).empty());
    // The same springs of a vertex in another order are another sum.
    std::vector<Spring> turned;
    for (Index v = 0; v + 2 < 400; ++v) {
        for (const Index offset : {2, 1}) turned.push_back({.i = v, .j = v + offset, .rest = 1.0, .k = 1.0});
    }
    EXPECT_TRUE(spring_stencil(spring_arrays(turned, place, 400)).empty());
}

TEST(SpringKernels, EveryVersionFindsTheLargestStretchWhereverItIs) {
    const Tangle tangle;
    for (const SpringKernels& kernels : spring_kernels()) {
        for (std::size_t longest = 0; longest < tangle.springs.size(); ++longest) {
            SpringArrays springs = tangle.springs;
            springs.inverse_rest[longest] *= 100.0;
            double expected = 0.0;
            for (std::size_t s = 0; s < springs.size(); ++s) {
                const Vector3 along = tangle.position.col(springs.j[s]) - tangle.position.col(springs.i[s]);
                expected = std::max(expected, along.norm() * springs.inverse_rest[s]);
            }
            EXPECT_NEAR(kernels.largest_stretch(springs, tangle.state), expected, 1e-12 * expected) << kernels.target;
        }
    }
}

TEST(SpringKernels, EveryVersionTakesOverAndGivesBackWhatIsInTheRangeOnly) {
    constexpr Index columns = 29;
    Matrix3X from(3, columns);
    std::iota(from.data(), from.data() + from.size(), 1.0);
    for (const SpringKernels& kernels : spring_kernels()) {
        for (Index count = 0; count <= columns - 5; ++count) {
            SCOPED_TRACE(std::string(kernels.target) + ", " + std::to_string(count));
            const Range range{5, count};
            constexpr Index local = 2;
            Matrix4X taken = Matrix4X::Zero(4, columns);
            kernels.take_over(from, range, local, taken);
            Matrix4X expected = Matrix4X::Zero(4, columns);
            expected.block(0, local, 3, count) = from.middleCols(range.first, count);
            EXPECT_EQ(taken, expected);
            Matrix3X given = Matrix3X::Constant(3, columns, -1.0);
            kernels.give_back(taken, local, range, given);
            Matrix3X back = Matrix3X::Constant(3, columns, -1.0);
            back.middleCols(range.first, count) = from.middleCols(range.first, count);
            EXPECT_EQ(given, back);
        }
    }
}

}  // namespace
}  // namespace trocar
