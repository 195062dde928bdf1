// What nodes of several levels pull each other by while some of them become active and interpolated.
#include "tissue/region_levels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "support/random_vectors.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

/// Springs of rest length 0 pull by k times their length, so that all is linear and interpolation loses nothing.
class RegionLevels : public testing::Test {
protected:
    RegionLevels() { region.start(); }

    static test::TissueSample zero_length() {
        test::TissueSample s = test::make_disc(0.05, 0.001, 100.0, 0.2, 1.1e-5);
        for (Spring& spring : s.materials.springs) spring.rest = spring.preload = 0.0;
        return s;
    }
    MovingTissue& taken() {
        tissue.take_over(test::empty_output(s.topology), s.frame);
        return tissue;
    }
    /// Passes a force on a node on to what it moves with.
    void pass_on(std::size_t level, Index node, const Vector3& force, std::vector<Matrix3X>& to) {
        const NodeLevel& here = region.levels()[level];
        if (here.fixed[at(node)] != 0) return;
        if (here.active[at(node)] != 0) {
            to[level].col(node) += force;
            return;
        }
        for (std::size_t n = 0; n < 3; ++n) {
            const double weight = here.weight[at(node)][n];
            if (weight != 0.0) pass_on(level + 1, here.parent[at(node)][n], weight * force, to);
        }
    }
    [[nodiscard]] std::vector<Matrix3X> nothing() {
        std::vector<Matrix3X> forces;
        for (const NodeLevel& level : region.levels()) {
            forces.emplace_back(Matrix3X::Zero(3, static_cast<Eigen::Index>(level.size())));
        }
        return forces;
    }
    /// N, on what is active, by the places of all vertices.
    std::vector<Matrix3X> expected() {
        Frame frame = s.frame;
        region.complete(frame);
        Matrix3X force;
        frame.velocity.setZero();
        internal_force(s.materials, frame.position, frame.velocity, force);
        std::vector<Matrix3X> forces = nothing();
        for (std::size_t v = 0; v < tissue.state().size(); ++v) {
            pass_on(0, static_cast<Index>(v), force.col(tissue.state().vertex[v]), forces);
        }
        return forces;
    }
    /// N, by the levels' own edges that end at something active, and by what they have of the interpolated part.
    std::vector<Matrix3X> found() {
        std::vector<Matrix3X> forces = nothing();
        std::vector<NodeLevel>& levels = region.levels();
        region.next_moment();
        for (std::size_t level = 1; level < levels.size(); ++level) {
            NodeLevel& here = levels[level];
            for (Index node = 0; at(node) < here.size(); ++node) region.refresh(level, node);
            for (const Index node : here.active_nodes) forces[level].col(node) += here.force.col(node).head<3>();
            for (std::size_t e = 0; e < here.i.size(); ++e) {
                if (here.active[at(here.i[e])] == 0 && here.active[at(here.j[e])] == 0) continue;
                const Vector3 apart = (here.displacement.col(here.j[e]) - here.displacement.col(here.i[e])).head<3>();
                const Vector3 pull = full(here.stiffness[e]) * apart;
                pass_on(level, here.i[e], pull, forces);
                pass_on(level, here.j[e], -pull, forces);
            }
        }
        return forces;
    }
    void move_active() {
        for (std::size_t level = 1; level < region.levels().size(); ++level) {
            NodeLevel& here = region.levels()[level];
            for (const Index node : here.active_nodes) {
                here.displacement.col(node).head<3>() += 1e-3 * test::random_vector(number, random);
            }
        }
    }
    void compare(const char* when) {
        const std::vector<Matrix3X> by_places = expected();
        const std::vector<Matrix3X> by_levels = found();
        double largest = 0.0;
        for (const Matrix3X& level : by_places) largest = std::max(largest, level.cwiseAbs().maxCoeff());
        EXPECT_GT(largest, 1e-3);
        for (std::size_t level = 1; level < by_places.size(); ++level) {
            EXPECT_LT((by_levels[level] - by_places[level]).cwiseAbs().maxCoeff(), 1e-10 * largest)
                << when << ", level " << level;
        }
    }

    test::TissueSample s = zero_length();
    MovingTissue tissue{s.topology, s.materials};
    WrittenVertices written{taken().state()};
    BodyBoxes boxes{s.topology};
    RegionTissue region{tissue, written, boxes, s.topology, s.frame.position, 60};
    std::mt19937 random{7};
    std::uniform_real_distribution<double> number{-1.0, 1.0};
};

TEST_F(RegionLevels, NodesThatAreActiveArePulledByThePlacesOfAllVerticesWhicheverOthersAreInterpolated) {
    const std::size_t last = region.levels().size() - 1;
    ASSERT_GE(last, 3U) << "a level that is interpolated on one that is interpolated";
    move_active();
    compare("all interpolated");
    for (int round = 0; round < 4; ++round) {
        for (std::size_t level = 1; level < last; ++level) {
            for (Index node = 0; at(node) < region.levels()[level].size(); ++node) {
                if (random() % 3 == 0) region.activate(level, node);
            }
        }
        compare("some active");
        move_active();
        compare("some have moved by themselves");
        for (std::size_t level = last - 1; level > 0; --level) {
            const std::vector<Index> active = region.levels()[level].active_nodes;
            for (const Index node : active) {
                if (random() % 2 == 0) region.interpolate(level, node);
            }
        }
        compare("some interpolated where they were");
        move_active();
        compare("carried on from there");
    }
    region.start();
    Frame frame = s.frame;
    region.complete(frame);
    for (std::size_t v = 0; v < tissue.state().size(); ++v) {
        const Vector3 place = tissue.state().position.col(eigen_index(v)).head<3>();
        EXPECT_EQ(Vector3(frame.position.col(tissue.state().vertex[v])), place);
    }
    move_active();
    compare("anew");
}

TEST_F(RegionLevels, NodesThatNothingMovesWithBecomeInterpolatedWithoutAPush) {
    ASSERT_GE(region.levels().size(), 3U);
    for (Index node = 0; at(node) < region.levels()[0].size(); ++node) region.activate(0, node);
    NodeLevel& first = region.levels()[1];
    for (Index node = 0; at(node) < first.size(); ++node) region.activate(1, node);
    const std::vector<Index> active = first.active_nodes;
    for (const Index node : active) first.velocity.col(node).head<3>() = test::random_vector(number, random);
    for (const Index node : active) region.interpolate(1, node);
    for (std::size_t level = 1; level < region.levels().size(); ++level) {
        EXPECT_EQ(region.levels()[level].velocity.cwiseAbs().maxCoeff(), 0.0) << level;
    }
}

TEST_F(RegionLevels, NodesBecomeActiveAndBecomeInterpolatedWithoutMovingAVertex) {
    const std::size_t last = region.levels().size() - 1;
    move_active();
    const auto places = [this] {
        Frame frame = s.frame;
        region.complete(frame);
        return frame.position;
    };
    for (int round = 0; round < 4; ++round) {
        Matrix3X before = places();
        for (std::size_t level = 1; level < last; ++level) {
            for (Index node = 0; at(node) < region.levels()[level].size(); ++node) {
                region.next_moment();
                if (random() % 3 == 0) region.activate(level, node);
            }
        }
        EXPECT_LT((places() - before).cwiseAbs().maxCoeff(), 1e-15) << round;
        move_active();
        before = places();
        for (std::size_t level = 1; level < last; ++level) {
            const std::vector<Index> active = region.levels()[level].active_nodes;
            for (const Index node : active) region.interpolate(level, node);
        }
        EXPECT_LT((places() - before).cwiseAbs().maxCoeff(), 1e-15) << round;
    }
}

}  // namespace
}  // namespace trocar
