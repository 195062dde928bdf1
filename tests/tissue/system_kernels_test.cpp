// The inner loops of conjugate gradients on an implicit step: against loops that do one thing at a time, and every
// instruction set against the others.
#include "tissue/system_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace trocar {
namespace {

constexpr std::size_t count = 37;  // nodes that move by themselves
constexpr std::size_t ghosts = 6;

using Numbers = std::vector<double>;

struct Sample {
    std::mt19937 random{11};
    std::uniform_real_distribution<double> number{-1.0, 1.0};
    std::vector<SystemEdge> edges;
    Numbers direction = vector(), image = vector(), change = vector(), residual = vector();
    Numbers inverse, inertia;

    Sample() {
        for (std::size_t own = 0; own < count; ++own) {
            // None, one or several after each other, some of them to the same node.
            for (std::size_t n = 0; n < own % 5; ++n) {
                SystemEdge edge{.own = static_cast<Index>(own),
                                .other = static_cast<Index>((own + 1 + 7 * n) % (count + ghosts))};
                if (edge.other == edge.own) continue;
                for (std::size_t c = 0; c < 3; ++c) {
                    for (std::size_t r = 0; r < 3; ++r) edge.block[4 * c + r] = static_cast<float>(number(random));
                }
                edges.push_back(edge);
            }
        }
        for (std::size_t n = 0; n < count; ++n) {
            inertia.push_back(1.0 + number(random));
            for (int c = 0; c < 3; ++c) {
                for (int r = 0; r < 4; ++r) inverse.push_back(r < 3 ? number(random) : 0.0);
            }
        }
    }
    Numbers vector() {
        Numbers numbers;
        for (std::size_t n = 0; n < count + ghosts; ++n) {
            for (int r = 0; r < 4; ++r) numbers.push_back(r < 3 ? number(random) : 0.0);
        }
        return numbers;
    }
};

/// All that the loops give, one after the other.
Numbers results_of(const SystemKernels& kernels) {
    Sample s;
    Numbers preconditioned(s.direction.size(), 0.0);
    kernels.multiply(s.edges, s.direction.data(), s.image.data());
    Numbers all = s.image;
    all.push_back(kernels.improve(count, 0.3, s.direction.data(), s.image.data(), s.inverse.data(), s.change.data(),
                                  s.residual.data(), preconditioned.data()));
    kernels.turn(count, 0.7, preconditioned.data(), s.inertia.data(), s.direction.data(), s.image.data());
    all.push_back(kernels.dot(count, s.direction.data(), s.image.data()));
    for (const Numbers* numbers : {&s.change, &s.residual, &preconditioned, &s.direction, &s.image}) {
        all.insert(all.end(), numbers->begin(), numbers->end());
    }
    return all;
}

/// The same without vectors.
Numbers plain_results() {
    Sample s;
    for (const SystemEdge& edge : s.edges) {
        for (std::size_t r = 0; r < 3; ++r) {
            double push = 0.0;
            for (std::size_t c = 0; c < 3; ++c) {
                push += static_cast<double>(edge.block[4 * c + r]) *
                        (s.direction[4 * static_cast<std::size_t>(edge.own) + c] -
                         s.direction[4 * static_cast<std::size_t>(edge.other) + c]);
            }
            s.image[4 * static_cast<std::size_t>(edge.own) + r] += push;
            s.image[4 * static_cast<std::size_t>(edge.other) + r] -= push;
        }
    }
    Numbers all = s.image;
    Numbers preconditioned(s.direction.size(), 0.0);
    double product = 0.0;
    for (std::size_t n = 0; n < count; ++n) {
        for (std::size_t r = 0; r < 3; ++r) {
            s.change[4 * n + r] += 0.3 * s.direction[4 * n + r];
            s.residual[4 * n + r] -= 0.3 * s.image[4 * n + r];
        }
        for (std::size_t r = 0; r < 3; ++r) {
            for (std::size_t c = 0; c < 3; ++c) {
                preconditioned[4 * n + r] += s.inverse[12 * n + 4 * c + r] * s.residual[4 * n + c];
            }
            product += preconditioned[4 * n + r] * s.residual[4 * n + r];
        }
    }
    all.push_back(product);
    double dot = 0.0;
    for (std::size_t n = 0; n < count; ++n) {
        for (std::size_t r = 0; r < 3; ++r) {
            s.direction[4 * n + r] = preconditioned[4 * n + r] + 0.7 * s.direction[4 * n + r];
            s.image[4 * n + r] = s.inertia[n] * s.direction[4 * n + r];
            dot += s.direction[4 * n + r] * s.image[4 * n + r];
        }
    }
    all.push_back(dot);
    for (const Numbers* numbers : {&s.change, &s.residual, &preconditioned, &s.direction, &s.image}) {
        all.insert(all.end(), numbers->begin(), numbers->end());
    }
    return all;
}

TEST(SystemKernels, GiveWhatPlainLoopsGive) {
    const Numbers plain = plain_results();
    const Numbers quick = results_of(system_kernels().front());
    ASSERT_EQ(plain.size(), quick.size());
    for (std::size_t n = 0; n < plain.size(); ++n) EXPECT_NEAR(plain[n], quick[n], 1e-12) << n;
}

TEST(SystemKernels, EveryInstructionSetGivesTheSameBits) {
    const Numbers first = results_of(system_kernels().front());
    for (const SystemKernels& kernels : system_kernels()) EXPECT_EQ(results_of(kernels), first) << kernels.target;
}

}  // namespace
}  // namespace trocar
