#include "tissue/spring_kernels.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "support/random_vectors.hpp"
#include "tissue/mass_spring.hpp"
#include "tissue/spring_system.hpp"

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

/// A dv = b of the linearly implicit step as its equation says, spring by spring: A = M + h (C + D) + h² K and
/// b = h f - h² K v, of K without what a spring that pushes does across itself; a spring of zero length has no
/// direction and does nothing. What is held keeps its place: its rows and columns are 0.
struct ImplicitEquation {
    Eigen::MatrixXd a;
    Matrix3X right_side;

    ImplicitEquation(const Tangle& tangle, double h) {
        const Eigen::Index count = tangle.position.cols();
        a = Eigen::MatrixXd::Zero(3 * count, 3 * count);
        Eigen::MatrixXd stiffness = a;
        for (const Spring& spring : tangle.materials.springs) {
            const Vector3 d = tangle.position.col(spring.j) - tangle.position.col(spring.i);
            const double length = d.norm();
            if (length == 0.0) continue;
            const Matrix3 along = d * d.transpose() / (length * length);
            const double tension = spring.preload + spring.k * (length - spring.rest);
            const Matrix3 k = spring.k * along + std::max(tension, 0.0) / length * (Matrix3::Identity() - along);
            for (const Index v : {spring.i, spring.j}) {
                for (const Index w : {spring.i, spring.j}) {
                    const double sign = v == w ? 1.0 : -1.0;
                    stiffness.block<3, 3>(3 * v, 3 * w) += sign * k;
                    a.block<3, 3>(3 * v, 3 * w) += sign * h * spring.damping * along;
                }
            }
        }
        a += h * h * stiffness;
        Matrix3X going = tangle.velocity;
        internal_force(tangle.materials, tangle.position, tangle.velocity, right_side);
        right_side += tangle.state.constant.topRows<3>();
        for (Eigen::Index v = 0; v < count; ++v) {
            const auto i = static_cast<std::size_t>(v);
            right_side.col(v) -= tangle.state.drag[i] * tangle.velocity.col(v);
            if (tangle.state.inverse_mass[i] == 0.0) {
                going.col(v).setZero();
            } else {
                a.diagonal().segment<3>(3 * v).array() += 1.0 / tangle.state.inverse_mass[i] + h * tangle.state.drag[i];
            }
        }
        right_side = h * right_side - h * h * times(stiffness, going);
        for (Eigen::Index v = 0; v < count; ++v) {
            if (tangle.state.inverse_mass[static_cast<std::size_t>(v)] != 0.0) continue;
            right_side.col(v).setZero();
            a.middleRows<3>(3 * v).setZero();
            a.middleCols<3>(3 * v).setZero();
        }
    }
    static Matrix3X times(const Eigen::MatrixXd& matrix, const Matrix3X& vector) {
        const Eigen::VectorXd product = matrix * Eigen::Map<const Eigen::VectorXd>(vector.data(), vector.size());
        return Eigen::Map<const Matrix3X>(product.data(), 3, vector.cols());
    }
};

TEST(SystemKernels, EveryVersionHasTheMatrixAndTheRightSideOfTheImplicitStep) {
    const Tangle tangle;
    constexpr double h = 1e-2;
    const ImplicitEquation expected(tangle, h);
    const Eigen::Index count = tangle.position.cols();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    Matrix4X vector = Matrix4X::Zero(4, count);
    for (Eigen::Index v = 0; v < count; ++v) {
        if (tangle.state.inverse_mass[static_cast<std::size_t>(v)] == 0.0) continue;
        vector.col(v).head<3>() = test::random_vector(unit, random);
    }
    const Matrix3X image = ImplicitEquation::times(expected.a, vector.topRows<3>());
    for (const SystemKernels& kernels : system_kernels()) {
        SCOPED_TRACE(kernels.target);
        SpringSystem system(tangle.springs.size(), tangle.state.size());
        kernels.linearise(h, tangle.springs, tangle.state, system);
        EXPECT_LT((system.right_side.topRows<3>() - expected.right_side).norm(), 1e-11);
        Matrix4X result = Matrix4X::Zero(4, count);
        const double product = kernels.multiply(tangle.springs, system, vector, result);
        EXPECT_LT((result.topRows<3>() - image).norm(), 1e-11);
        EXPECT_NEAR(product, vector.topRows<3>().cwiseProduct(image).sum(), 1e-11);
        kernels.invert_blocks(tangle.springs, system);
        for (Eigen::Index v = 0; v < count; ++v) {
            if (tangle.state.inverse_mass[static_cast<std::size_t>(v)] == 0.0) continue;
            const Eigen::Map<const Matrix4X> inverse(system.inverse.data() + 12 * v, 4, 3);
            const Matrix3 one = inverse.topRows<3>() * expected.a.block<3, 3>(3 * v, 3 * v);
            EXPECT_LT((one - Matrix3::Identity()).norm(), 1e-11) << v;
        }
    }
}

TEST(SystemKernels, EveryVersionTakesAStepOfConjugateGradientsAndTurnsTheDirection) {
    constexpr Index count = 13;
    constexpr double step = 0.3;
    constexpr double ratio = -0.7;
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto drawn = [&] {
        Matrix4X result = Matrix4X::Zero(4, count);
        for (Index v = 0; v < count; ++v) result.col(v).head<3>() = test::random_vector(unit, random);
        return result;
    };
    SpringSystem system(0, at(count));
    for (Index v = 0; v < 3 * count; ++v) {
        const Vector3 column = test::random_vector(unit, random);
        for (Index r = 0; r < 3; ++r) system.inverse[at(4 * v + r)] = column[r];
    }
    const Matrix4X solution = drawn();
    GradientVectors given;
    for (Matrix4X* vector : {&given.residual, &given.preconditioned, &given.direction, &given.image}) *vector = drawn();
    // x + a p, r - a q, z = B r, p' = z + b p and z r, vertex by vertex.
    Matrix3X solved(3, count);
    Matrix3X left(3, count);
    Matrix3X better(3, count);
    Matrix3X turned(3, count);
    double product = 0.0;
    for (Index v = 0; v < count; ++v) {
        const Eigen::Map<const Matrix4X> inverse(system.inverse.data() + 12 * v, 4, 3);
        solved.col(v) = solution.col(v).head<3>() + step * given.direction.col(v).head<3>();
        left.col(v) = given.residual.col(v).head<3>() - step * given.image.col(v).head<3>();
        better.col(v) = inverse.topRows<3>() * left.col(v);
        turned.col(v) = better.col(v) + ratio * given.direction.col(v).head<3>();
        product += better.col(v).dot(left.col(v));
    }
    Matrix4X first;
    for (const SystemKernels& kernels : system_kernels()) {
        SCOPED_TRACE(kernels.target);
        Matrix4X now = solution;
        GradientVectors vectors = given;
        EXPECT_NEAR(kernels.advance(system, step, now, vectors), product, 1e-12);
        kernels.turn(ratio, vectors);
        Matrix4X all(4, 5 * count);
        all << now, vectors.residual, vectors.preconditioned, vectors.direction, vectors.image;
        Matrix3X expected(3, 5 * count);
        expected << solved, left, better, turned, given.image.topRows<3>();
        EXPECT_LT((all.topRows<3>() - expected).cwiseAbs().maxCoeff(), 1e-13);
        EXPECT_EQ(all.row(3).cwiseAbs().maxCoeff(), 0.0);
        if (first.size() == 0) first = all;
        EXPECT_EQ(first, all) << "differs in a bit";
    }
    EXPECT_GT(system_kernels().size(), 1U) << "or nothing is compared";
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
