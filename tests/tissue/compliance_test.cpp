// Answers of tissue to pushes at a few vertices against a dense solve of the whole system.
#include "tissue/compliance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

#include "support/random_vectors.hpp"
#include "support/tangles.hpp"
#include "tissue/moving_tissue.hpp"

namespace trocar {
namespace {

TEST(ComplianceOf, TouchedVerticesIsThatOfTheWholeTissue) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
        const test::TissueSample sample = test::tangle(seed);
        MovingTissue tissue(sample.topology, sample.materials);
        tissue.take_over(test::empty_output(sample.topology), sample.frame);
        const SpringArrays& springs = tissue.spring_arrays();
        SpringSystem system(springs.size(), tissue.state().size());
        constexpr double h = 1e-3;  // s
        system_kernels().front().linearise(h, springs, tissue.state(), system);
        system_kernels().front().invert_blocks(springs, system);
        const Eigen::LDLT<Eigen::MatrixXd> whole(test::dense(springs, system));
        Compliance compliance(springs.size(), tissue.state().size());
        // The second time with other vertices: nothing of the first may be left.
        for (const std::vector<Index>& touched : {std::vector<Index>{3, 4, 17, 40}, std::vector<Index>{0, 30, 57}}) {
            compliance.begin(springs, system, touched);
            compliance.clear();
            std::mt19937 random(seed);
            std::uniform_real_distribution<double> unit(-1.0, 1.0);
            Eigen::MatrixXd pushes = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * system.inertia.size()),
                                                           static_cast<Eigen::Index>(compliance_lanes));
            for (std::size_t lane = 0; lane < compliance_lanes; ++lane) {
                const std::size_t spot = lane % touched.size();
                const Vector3 push = test::random_vector(unit, random);
                compliance.add(lane, static_cast<Index>(spot), push);
                pushes.col(static_cast<Eigen::Index>(lane)).segment<3>(3 * touched[spot]) += push;
            }
            compliance.solve(1e-13, 2000);
            const Eigen::MatrixXd expected = whole.solve(pushes);
            for (std::size_t lane = 0; lane < compliance_lanes; ++lane) {
                const auto column = expected.col(static_cast<Eigen::Index>(lane));
                for (std::size_t spot = 0; spot < touched.size(); ++spot) {
                    const Vector3 answer = compliance.answer(lane, static_cast<Index>(spot));
                    EXPECT_LT((answer - column.segment<3>(3 * touched[spot])).norm(), 1e-8 * column.norm())
                        << "seed " << seed << ", lane " << lane << ", vertex " << touched[spot];
                }
            }
        }
    }
}

/// Random numbers for the loops of the method: `count` vertices have been reached, the first `inner` of them had a
/// direction.
struct ReachedPart {
    static constexpr std::size_t count = 11;
    static constexpr std::size_t inner = 7;
    static constexpr std::size_t spring_count = 16;
    static constexpr std::size_t springs_inside = 13;
    SpringSystem system = SpringSystem(spring_count, count);
    ReachedTissue tissue;
    Lanes step{};
    Lanes ratio{};

    ReachedPart() {
        std::mt19937 random(5);
        std::uniform_real_distribution<double> number(-1.0, 1.0);
        for (std::vector<double>* array :
             {&system.x, &system.y, &system.z, &system.alpha, &system.beta, &system.inertia, &system.inverse}) {
            for (double& one : *array) one = number(random);
        }
        for (std::size_t n = 0; n < count; ++n) tissue.vertices.push_back(static_cast<Index>((3 * n + 1) % count));
        for (std::size_t n = 0; n < spring_count; ++n) {
            tissue.springs.push_back(static_cast<std::uint32_t>((5 * n + 2) % spring_count));
            tissue.ends.push_back({static_cast<std::uint32_t>(n % count), static_cast<std::uint32_t>((n + 3) % count)});
        }
        for (std::vector<double>* array :
             {&tissue.solution, &tissue.residual, &tissue.preconditioned, &tissue.direction, &tissue.image}) {
            array->resize(3 * compliance_lanes * count);
            for (double& one : *array) one = number(random);
        }
        std::fill(tissue.direction.begin() + static_cast<std::ptrdiff_t>(3 * compliance_lanes * inner),
                  tissue.direction.end(), 0.0);
        for (double& one : step) one = number(random);
        for (double& one : ratio) one = number(random);
    }
    [[nodiscard]] std::vector<double> with(const Lanes& curvature, const Lanes& product) const {
        std::vector<double> all(curvature.begin(), curvature.end());
        all.insert(all.end(), product.begin(), product.end());
        for (const std::vector<double>* array :
             {&tissue.solution, &tissue.residual, &tissue.preconditioned, &tissue.direction, &tissue.image}) {
            all.insert(all.end(), array->begin(), array->end());
        }
        return all;
    }
};

/// All that the loops give, one after the other.
std::vector<double> given_by(const ComplianceKernels& kernels) {
    ReachedPart part;
    const Lanes curvature =
        kernels.multiply(part.system, ReachedPart::inner, ReachedPart::count, ReachedPart::springs_inside, part.tissue);
    const Lanes product = kernels.advance(part.system, part.step, ReachedPart::inner, ReachedPart::count, part.tissue);
    kernels.turn(part.ratio, ReachedPart::count, part.tissue);
    return part.with(curvature, product);
}

/// The same one right side after the other, by small matrices.
std::vector<double> given_by_small_matrices() {
    ReachedPart part;
    ReachedTissue& tissue = part.tissue;
    Lanes curvature{};
    Lanes product{};
    for (std::size_t lane = 0; lane < compliance_lanes; ++lane) {
        const auto of = [lane](std::vector<double>& array, std::size_t n) {
            constexpr int stride = static_cast<int>(compliance_lanes);
            return Eigen::Map<Vector3, Eigen::Unaligned, Eigen::InnerStride<stride>>(array.data() +
                                                                                     3 * compliance_lanes * n + lane);
        };
        for (std::size_t n = 0; n < ReachedPart::count; ++n) {
            of(tissue.image, n) = part.system.inertia[at(tissue.vertices[n])] * of(tissue.direction, n);
        }
        for (std::size_t n = 0; n < ReachedPart::springs_inside; ++n) {
            const std::size_t spring = tissue.springs[n];
            const Vector3 u(part.system.x[spring], part.system.y[spring], part.system.z[spring]);
            const Matrix3 block =
                part.system.alpha[spring] * u * u.transpose() + part.system.beta[spring] * Matrix3::Identity();
            const auto [a, b] = tissue.ends[n];
            const Vector3 push = block * (of(tissue.direction, a) - of(tissue.direction, b));
            of(tissue.image, a) += push;
            of(tissue.image, b) -= push;
        }
        for (std::size_t n = 0; n < ReachedPart::count; ++n) {
            if (n < ReachedPart::inner) {
                curvature[lane] += of(tissue.direction, n).dot(of(tissue.image, n));
                of(tissue.solution, n) += part.step[lane] * of(tissue.direction, n);
            }
            of(tissue.residual, n) -= part.step[lane] * of(tissue.image, n);
            const Eigen::Map<const Eigen::Matrix<double, 4, 3>> inverse(part.system.inverse.data() +
                                                                        12 * at(tissue.vertices[n]));
            const Vector3 better = inverse.topRows<3>() * Vector3(of(tissue.residual, n));
            of(tissue.preconditioned, n) = better;
            product[lane] += better.dot(Vector3(of(tissue.residual, n)));
            of(tissue.direction, n) = better + part.ratio[lane] * Vector3(of(tissue.direction, n));
        }
    }
    return part.with(curvature, product);
}

TEST(ComplianceKernels, EveryVersionGivesWhatSmallMatricesGiveAndTheSameBits) {
    const std::vector<double> plain = given_by_small_matrices();
    const std::vector<double> first = given_by(compliance_kernels().front());
    ASSERT_EQ(plain.size(), first.size());
    for (std::size_t n = 0; n < plain.size(); ++n) EXPECT_NEAR(plain[n], first[n], 1e-12) << n;
    for (const ComplianceKernels& kernels : compliance_kernels()) EXPECT_EQ(given_by(kernels), first) << kernels.target;
}

}  // namespace
}  // namespace trocar
