// The stepper `adaptive_multires` where it does not step the whole: against `implicit` on the same sheets, and what it
// owes of motion where most of the tissue is interpolated.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "measure/allocations.hpp"
#include "method/registry.hpp"
#include "support/energy.hpp"
#include "support/random_vectors.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/body_boxes.hpp"
#include "tissue/mass_spring.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/region_levels.hpp"
#include "tissue/written_vertices.hpp"

namespace trocar {
namespace {

constexpr double dt = 1e-3;      // s
constexpr double radius = 0.05;  // m
constexpr double edge = 0.002;   // m
constexpr double mass = 1.1e-5;  // kg, 3 mm of tissue at that edge
constexpr double tool = 0.004;   // m, radius

using Settings = std::map<std::string, std::string>;

Settings with(const std::string& error) { return {{"whole", "0"}, {"error", error}}; }

/// The disc that all tests here press; built once.
const test::TissueSample& disc() {
    static const test::TissueSample sample = [] {
        test::TissueSample s = test::make_disc(radius, edge, 100.0, 0.2, mass);
        s.materials.drag.assign(s.materials.drag.size(), 20.0 * mass);
        return s;
    }();
    return sample;
}

/// A flat tool that comes down at 20 mm/s, stays 2 mm deep and then goes along x at 20 mm/s.
struct Press : test::Stepped {
    double friction = 0.0;
    /// > 0: two faces press each vertex, tilted by so much (rad) along and against the motion; they stay with it.
    double tilt = 0.0;
    int placed_from = -1;  ///< tick in which a vertex far from the tool is put somewhere, and held for two more
    int tick = 0;

    Press(const std::string& name, const Settings& settings) : Stepped(disc(), make_stepper(name, settings)) {}
    [[nodiscard]] static double depth(int tick) { return std::min(0.002, 0.02 * dt * tick); }
    [[nodiscard]] static double along(int tick) { return 0.02 * dt * std::max(0, tick - 200); }

    void step() {
        output.clear();
        const double sinks = (depth(tick + 1) - depth(tick)) / dt;
        const double goes = (along(tick + 1) - along(tick)) / dt;
        for (Index v = 0; v < s.topology.vertex_count; ++v) {
            const Vector3 rest = disc().frame.position.col(v);
            if (s.materials.pinned[static_cast<std::size_t>(v)] != 0) continue;
            if ((rest - Vector3(tilt > 0.0 ? 0.0 : along(tick), 0.0, 0.0)).norm() > tool) continue;
            const double gap = -depth(tick) - s.frame.position(2, v);
            ContactForceLaw contact = test::plane_contact(v, -Vector3::UnitZ(), gap, 140.0, 0.0);
            contact.face_velocity = sinks;
            contact.reaction_body = 0;
            contact.friction = friction;
            contact.tangent_k = friction > 0.0 ? 140.0 : 0.0;
            contact.surface_velocity = Vector3(goes, 0.0, -sinks);
            if (friction > 0.0) contact.slip_key = v;
            for (const double by : {-tilt, tilt}) {
                contact.normal = Vector3(std::sin(by), 0.0, -std::cos(by));
                output.contacts.push_back(contact);
                if (tilt == 0.0) break;
            }
        }
        if (placed_from >= 0 && tick >= placed_from && tick < placed_from + 3) {
            const Index v = s.topology.vertex_count / 3;
            output.position_corrections.push_back(
                {v, s.frame.position.col(v) + Vector3(0.0, 0.0, 1e-4), Vector3::Zero(), true});
        }
        const Outcome outcome = advance();
        ASSERT_TRUE(outcome.ok()) << outcome.message;
        ++tick;
    }
    [[nodiscard]] Vector3 force() const { return reaction[0].force; }
};

/// Of the force at the tool, over the largest: worst tick and the last one, against the whole tissue.
struct ForceError {
    double worst = 0.0;
    double last = 0.0;
    double sideways = 0.0;
    double last_sideways = 0.0;
};

ForceError force_error(const Settings& settings, double friction, int ticks) {
    Press whole("implicit", {{"tolerance", "1e-4"}});
    Press adaptive_multires("adaptive_multires", settings);
    whole.friction = adaptive_multires.friction = friction;
    ForceError error;
    double most = 0.0;
    for (int tick = 0; tick < ticks; ++tick) {
        whole.step();
        adaptive_multires.step();
        most = std::max(most, whole.force().norm());
        error.last = std::abs(adaptive_multires.force().z() - whole.force().z());
        error.worst = std::max(error.worst, error.last);
        error.last_sideways = std::abs(adaptive_multires.force().x() - whole.force().x());
        error.sideways = std::max(error.sideways, error.last_sideways);
    }
    EXPECT_GT(most, 0.05) << "it presses";
    error.worst /= most;
    error.last /= most;
    error.sideways /= most;
    error.last_sideways /= most;
    return error;
}

TEST(AdaptiveMultires, TheForceAtTheToolIsThatOfTheWholeTissueWithinOnePercent) {
    const ForceError error = force_error(with("0.005"), 0.0, 350);
    EXPECT_LT(error.worst, 0.01);
    EXPECT_LT(error.last, 0.005);
    EXPECT_GT(error.worst, 1e-5) << "it does not step the whole";
}

TEST(AdaptiveMultires, FrictionIsThatOfTheWholeTissue) {
    const ForceError error = force_error(with("0.005"), 0.3, 300);
    EXPECT_LT(error.worst, 0.01);
    // While it takes hold the two differ by what they take for the critical damper of a sticking contact.
    EXPECT_LT(error.sideways, 0.02);
    EXPECT_LT(error.last_sideways, 0.005) << "it slides";
}

/// Two faces that press a vertex alike share one tangential spring: which of them has it must not change from round to
/// round of one step, or the last round decides what friction is, and single ticks have a third of it.
TEST(AdaptiveMultires, FrictionDoesNotJumpWhereTwoFacesPressAlike) {
    for (const auto& [name, settings] :
         {std::pair<std::string, Settings>{"implicit", {}}, {"adaptive_multires", with("0.01")}}) {
        Press p(name, settings);
        p.friction = 0.3;
        p.tilt = 0.2;
        double jump = 0.0;
        Vector3 before = Vector3::Zero();
        for (int tick = 0; tick < 300; ++tick) {
            p.step();
            if (tick > 230) jump = std::max(jump, (p.force() - before).norm());
            before = p.force();
        }
        EXPECT_GT(std::abs(p.force().x()), 0.2 * p.force().z()) << name << ": it slides";
        EXPECT_LT(jump, 0.05 * p.force().norm()) << name;
    }
}

/// Sixty contacts on the disc's middle, every fifth from the other side; those that only come near have no damper in
/// the step in which others push them there: dampers, and all touch.
ResponseOutput many_contacts(double k, bool damped, std::mt19937& random) {
    std::vector<Index> near;
    for (Index v = 0; v < disc().topology.vertex_count; ++v) {
        if (disc().frame.position.col(v).norm() < 0.012) near.push_back(v);
    }
    EXPECT_GT(near.size(), 60U);
    std::shuffle(near.begin(), near.end(), random);
    ResponseOutput output = test::empty_output(disc().topology);
    for (std::size_t c = 0; c < 60; ++c) {
        const double gap = damped ? std::uniform_real_distribution(-1e-4, 0.0)(random)
                                  : std::uniform_real_distribution(-1e-4, 5e-5)(random);
        const Vector3 tilt(std::uniform_real_distribution(-0.5, 0.5)(random),
                           std::uniform_real_distribution(-0.5, 0.5)(random), 1.0);
        output.contacts.push_back(test::plane_contact(near[c], (c % 5 == 0 ? 1.0 : -1.0) * tilt.normalized(), gap, k,
                                                      damped ? 0.003 * k : 0.0));
    }
    return output;
}

/// What each of them gives in one tick from rest; `s` is as it is after that.
std::vector<ContactForce> given_at_once(const std::string& name, const Settings& settings, const ResponseOutput& output,
                                        test::TissueSample& s) {
    s = disc();
    const auto stepper = make_stepper(name, settings);
    stepper->prepare(s.topology, s.materials);
    std::vector<Wrench> reaction(1);
    // The region is filled by some nodes a tick: contacts that are too far away to press activate the same nodes.
    ResponseOutput beyond = output;
    for (ContactForceLaw& contact : beyond.contacts) contact.gap = 1.0;
    for (int tick = 0; tick < 30; ++tick) {
        EXPECT_TRUE(stepper->advance(beyond, dt, s.frame, s.frame, reaction).ok());
    }
    EXPECT_TRUE(stepper->advance(output, dt, s.frame, s.frame, reaction).ok());
    EXPECT_EQ(stepper->contact_forces().size(), output.contacts.size());
    return {stepper->contact_forces().begin(), stepper->contact_forces().end()};
}

std::vector<double> normals_at_once(const std::string& name, const Settings& settings, const ResponseOutput& output) {
    std::vector<double> normals;
    test::TissueSample s;
    for (const ContactForce& load : given_at_once(name, settings, output, s)) normals.push_back(load.normal);
    return normals;
}

/// Of `implicit`, which solves for a guessed set with the whole compliance, and of the convex minimum here. Contact by
/// contact, so that a wrong set would show.
TEST(AdaptiveMultires, EveryContactGivesWhatItGivesInTheWholeTissue) {
    std::mt19937 random(5);
    int pressing = 0;
    int left = 0;
    for (int round = 0; round < 16; ++round) {
        const double k = std::pow(10.0, 2.0 + round % 4);
        const ResponseOutput output = many_contacts(k, round % 2 == 1, random);
        const std::vector<double> whole = normals_at_once("implicit", {{"tolerance", "1e-10"}}, output);
        const std::vector<double> given =
            normals_at_once("adaptive_multires", {{"whole", "0"}, {"error", "0.001"}, {"tolerance", "1e-8"}}, output);
        const double most = *std::max_element(whole.begin(), whole.end());
        for (std::size_t c = 0; c < whole.size(); ++c) {
            EXPECT_NEAR(given[c], whole[c], 1e-4 * most) << round << ", contact " << c << ", k " << k;
            (whole[c] > 0.0 ? pressing : left) += 1;
        }
    }
    EXPECT_GT(pressing, 300);
    EXPECT_GT(left, 100);
}

/// A contact that gives nothing where a step begins and its limit where it ends does not give way at either.
TEST(AdaptiveMultires, AContactMayGoFromNothingToItsLimitInOneStep) {
    std::mt19937 random(8);
    int at_limit = 0;
    int nothing = 0;
    int between = 0;
    for (int round = 0; round < 12; ++round) {
        ResponseOutput output = many_contacts(1e6, false, random);
        const double limit = std::pow(10.0, -1.0 - round % 3);  // N
        for (ContactForceLaw& contact : output.contacts) contact.limit = limit;
        const std::vector<double> whole = normals_at_once("implicit", {{"tolerance", "1e-10"}}, output);
        const std::vector<double> given =
            normals_at_once("adaptive_multires", {{"whole", "0"}, {"error", "0.001"}, {"tolerance", "1e-8"}}, output);
        for (std::size_t c = 0; c < whole.size(); ++c) {
            EXPECT_NEAR(given[c], whole[c], 1e-3 * limit) << round << ", contact " << c << ", limit " << limit;
            (given[c] > 0.999 * limit ? at_limit : given[c] == 0.0 ? nothing : between) += 1;
        }
    }
    EXPECT_GT(at_limit, 50);
    EXPECT_GT(nothing, 50);
    EXPECT_GT(between, 50);
}

/// What a contact gave in the last step is where the next one begins, whatever it was: not what it finds.
TEST(AdaptiveMultires, WhatContactsGaveBeforeHasNoPartInWhatTheyGive) {
    std::mt19937 random(9);
    const Settings exact{{"whole", "0"}, {"tolerance", "1e-9"}};
    int other = 0;
    for (int round = 0; round < 6; ++round) {
        ResponseOutput first = many_contacts(1e5, round % 2 == 1, random);
        ResponseOutput second = many_contacts(1e5, round % 2 == 1, random);
        std::array<std::vector<double>, 2> given;
        for (const bool known : {false, true}) {
            // The contacts of the second step have nothing but their numbers from the first.
            for (ResponseOutput* output : {&first, &second}) {
                for (std::size_t c = 0; c < output->contacts.size(); ++c) {
                    output->contacts[c].source_id = known ? c + 1 : 0;
                }
            }
            test::TissueSample s = disc();
            const auto stepper = make_stepper("adaptive_multires", exact);
            stepper->prepare(s.topology, s.materials);
            std::vector<Wrench> reaction(1);
            for (const ResponseOutput* output : {&first, &first, &second}) {
                ASSERT_TRUE(stepper->advance(*output, dt, s.frame, s.frame, reaction).ok());
                for (const ContactForce& load : stepper->contact_forces()) given[known ? 1 : 0].push_back(load.normal);
            }
        }
        const double most = *std::max_element(given[0].begin(), given[0].end());
        for (std::size_t c = 0; c < given[0].size(); ++c) {
            EXPECT_NEAR(given[1][c], given[0][c], 1e-6 * most) << round << ", contact " << c;
            other += given[1][c] != given[0][c] ? 1 : 0;
        }
    }
    EXPECT_GT(other, 100) << "it does begin elsewhere";
}

/// The stiffer a contact, the less of what is open shows in the rate at which it gives way.
TEST(AdaptiveMultires, StiffContactsAreFoundAsExactlyAsSoftOnes) {
    std::mt19937 random(6);
    for (const auto& [tolerance, bound] : {std::pair{"0.002", 0.01}, std::pair{"2e-4", 0.001}}) {
        for (const double k : {1e2, 1e4, 1e6, 1e8}) {
            for (int round = 0; round < 4; ++round) {
                const ResponseOutput output = many_contacts(k, false, random);
                const std::vector<double> exact =
                    normals_at_once("adaptive_multires", {{"whole", "0"}, {"tolerance", "1e-10"}}, output);
                const std::vector<double> given =
                    normals_at_once("adaptive_multires", {{"whole", "0"}, {"tolerance", tolerance}}, output);
                double differ = 0.0;
                double all = 0.0;
                for (std::size_t c = 0; c < exact.size(); ++c) {
                    differ += (given[c] - exact[c]) * (given[c] - exact[c]);
                    all += exact[c] * exact[c];
                }
                EXPECT_LT(std::sqrt(differ / all), bound) << "k " << k << ", tolerance " << tolerance;
            }
        }
    }
}

TEST(AdaptiveMultires, ATighterBoundIsKeptAndALooserOneSavesWork) {
    const double loose = force_error(with("0.05"), 0.0, 150).worst;
    const double tight = force_error(with("0.0025"), 0.0, 150).worst;
    EXPECT_LT(loose, 0.05);
    EXPECT_LT(tight, 0.0025);
    // Close tracking of the interpolated part hides the extent of the fine region.
    const auto unseen = [](const char* error) {
        return force_error({{"whole", "0"}, {"error", error}, {"relaxations", "3"}}, 0.0, 150).worst;
    };
    EXPECT_LT(unseen("0.0025"), 0.5 * unseen("0.05"));
}

TEST(AdaptiveMultires, AtMostASixteenthOfWhatIsFarMovesInATick) {
    Press p("adaptive_multires", with("0.05"));
    for (int tick = 0; tick < 50; ++tick) p.step();
    std::size_t most = 0;
    std::size_t far = 0;
    std::vector<int> last(static_cast<std::size_t>(p.s.topology.vertex_count), 0);
    for (int tick = 0; tick < 100; ++tick) {
        const Matrix3X before = p.s.frame.position;
        p.step();
        std::size_t moved = 0;
        far = 0;
        for (Index v = 0; v < p.s.topology.vertex_count; ++v) {
            if (disc().frame.position.col(v).norm() < 0.02 || p.s.materials.pinned[static_cast<std::size_t>(v)] != 0) {
                continue;
            }
            ++far;
            if (p.s.frame.position.col(v) == before.col(v)) continue;
            ++moved;
            last[static_cast<std::size_t>(v)] = tick;
        }
        most = std::max(most, moved);
    }
    EXPECT_LE(most, static_cast<std::size_t>(disc().topology.vertex_count) / 16);
    EXPECT_GT(far, static_cast<std::size_t>(disc().topology.vertex_count) / 2);
    int oldest = 100;
    for (Index v = 0; v < p.s.topology.vertex_count; ++v) {
        if (disc().frame.position.col(v).norm() < 0.02 || p.s.materials.pinned[static_cast<std::size_t>(v)] != 0)
            continue;
        oldest = std::min(oldest, last[static_cast<std::size_t>(v)]);
    }
    EXPECT_GT(oldest, 35) << "all of it is followed: a sixteenth in one tick of four";
}

TEST(AdaptiveMultires, AContactPressesWhereAVertexThatWasLeftBehindIsByNow) {
    Press p("adaptive_multires", {{"whole", "0"}, {"error", "0.05"}, {"relaxations", "3"}});
    for (int tick = 0; tick < 60; ++tick) p.step();
    Frame now = p.s.frame;
    p.stepper->complete(now);
    Index latest = 0;
    for (Index v = 0; v < p.s.topology.vertex_count; ++v) {
        const auto late = [&](Index one) { return p.s.frame.position(2, one) - now.position(2, one); };
        if (late(v) > late(latest)) latest = v;
    }
    const double sunk = p.s.frame.position(2, latest) - now.position(2, latest);
    ASSERT_GT(sunk, 1e-5) << "it is further down than the frame shows";
    // A plane below it, that it stands above in the frame and below by now.
    p.output.clear();
    constexpr double k = 140.0;  // N/m
    p.output.contacts.push_back(test::plane_contact(latest, Vector3::UnitZ(), 0.5 * sunk, k, 0.0));
    ASSERT_TRUE(p.stepper->advance(p.output, dt, p.s.frame, p.s.frame, p.reaction).ok());
    EXPECT_GT(p.stepper->contact_forces()[0].normal, 0.2 * k * 0.5 * sunk);
    EXPECT_LT(p.stepper->contact_forces()[0].normal, k * sunk);
}

TEST(AdaptiveMultires, LevelsEndWithTheFirstThatHasFewEnoughNodes) {
    MovingTissue tissue(disc().topology, disc().materials);
    tissue.take_over(test::empty_output(disc().topology), disc().frame);
    WrittenVertices written(tissue.state());
    BodyBoxes boxes(disc().topology);
    for (const std::size_t fewest : {std::size_t{300}, std::size_t{30}}) {
        const RegionTissue region(tissue, written, boxes, disc().topology, disc().frame.position, fewest);
        const std::vector<NodeLevel>& levels = region.levels();
        ASSERT_GE(levels.size(), 2U);
        EXPECT_LE(levels.back().size(), fewest);
        EXPECT_GT(levels[levels.size() - 2].size(), fewest);
    }
}

TEST(AdaptiveMultires, RestLastsAndComesBack) {
    Press p("adaptive_multires", with("0.005"));
    Frame still = p.s.frame;
    std::vector<Wrench> reaction(1);
    for (int tick = 0; tick < 1000; ++tick) {
        ASSERT_TRUE(p.stepper->advance(p.output, dt, still, still, reaction).ok());
    }
    EXPECT_LT((still.position - disc().frame.position).cwiseAbs().maxCoeff(), 1e-12);
    p.s.frame = still;
    for (int tick = 0; tick < 400; ++tick) p.step();
    EXPECT_GT((p.s.frame.position - disc().frame.position).cwiseAbs().maxCoeff(), 0.0019);
    p.output.clear();
    for (int tick = 0; tick < 2500; ++tick) {
        ASSERT_TRUE(p.stepper->advance(p.output, dt, p.s.frame, p.s.frame, reaction).ok());
    }
    // What the tool has left behind dies out, fine wrinkles among it.
    EXPECT_LT((p.s.frame.position - disc().frame.position).cwiseAbs().maxCoeff(), 2e-6);
}

TEST(AdaptiveMultires, WhatIsLeftBehindIsCompletedToTheEnergyOfTheWholeTissue) {
    const Settings late = {{"whole", "0"}, {"error", "0.01"}, {"relaxations", "30"}};
    Press whole("implicit", {{"tolerance", "1e-4"}});
    Press adaptive_multires("adaptive_multires", late);
    Press unasked("adaptive_multires", late);
    const double start = potential_energy(disc().materials, disc().frame.position);
    const auto gain = [start](const Frame& frame) {
        return potential_energy(disc().materials, frame.position) - start;
    };
    EXPECT_TRUE(adaptive_multires.stepper->leaves_behind());
    EXPECT_FALSE(whole.stepper->leaves_behind());
    double most = 0.0;
    double completed = 0.0;
    double shown = 0.0;
    for (int tick = 0; tick < 150; ++tick) {
        whole.step();
        adaptive_multires.step();
        unasked.step();
        Frame complete = adaptive_multires.s.frame;
        adaptive_multires.stepper->complete(complete);
        const double right = gain(whole.s.frame);
        most = std::max(most, right);
        completed = std::max(completed, std::abs(gain(complete) - right));
        shown = std::max(shown, std::abs(gain(adaptive_multires.s.frame) - right));
        ASSERT_EQ(adaptive_multires.s.frame.hash(), unasked.s.frame.hash()) << "asking has changed what it does";
    }
    EXPECT_LT(completed, 0.1 * most);
    EXPECT_GT(shown, 0.5 * most) << "nothing was late: this says nothing";
}

TEST(AdaptiveMultires, MomentumIsWhatContactsGiveWhereNothingHolds) {
    test::TissueSample s = disc();
    s.materials.pinned.assign(s.materials.pinned.size(), 0);
    s.materials.drag.assign(s.materials.drag.size(), 0.0);
    for (Spring& spring : s.materials.springs) spring.preload = 0.0;  // a rim that nothing holds would be drawn in
    test::Stepped p(s, make_stepper("adaptive_multires", with("0.02")));
    Vector3 given = Vector3::Zero();
    // What is far shows its velocity as the slices come by, so that the sum over a frame is complete when nothing
    // swings any more: the steps themselves take every swing.
    for (int tick = 0; tick < 3000; ++tick) {
        p.output.clear();
        if (tick < 100) p.output.held_force.col(0) = Vector3(0.002, 0.001, 0.0);
        given += dt * p.output.held_force.rowwise().sum();
        ASSERT_TRUE(p.advance().ok());
    }
    const Vector3 momentum = test::momentum_of(p.s.materials, p.s.frame);
    EXPECT_LT((momentum - given).norm(), 1e-6 * given.norm()) << momentum.transpose();
}

TEST(AdaptiveMultires, PreparedAnewItStartsAnew) {
    Press once("adaptive_multires", with("0.005"));
    Press twice("adaptive_multires", with("0.005"));
    EXPECT_TRUE(twice.stepper->contact_forces().empty()) << "before the first tick";
    for (int tick = 0; tick < 40; ++tick) twice.step();
    twice.stepper->prepare(twice.s.topology, twice.s.materials);
    twice.s.frame = disc().frame;
    twice.tick = 0;
    for (int tick = 0; tick < 40; ++tick) {
        once.step();
        twice.step();
        ASSERT_EQ(once.s.frame.hash(), twice.s.frame.hash()) << tick;
    }
}

TEST(AdaptiveMultires, FramesThatAreKnownAreWrittenWhereTheyChangeAndComeOutTheSame) {
    // One stepper reads its whole frame at every tick and writes all of it. The other may assume that its frames, three
    // that take turns as in a simulation, are as it has left them.
    Press slow("adaptive_multires", with("0.05"));
    slow.placed_from = 60;
    const test::TissueSample& s = disc();
    const auto fast = make_stepper("adaptive_multires", with("0.05"));
    fast->prepare(s.topology, s.materials);
    std::array<Frame, 3> frames{s.frame, s.frame, s.frame};
    std::vector<Wrench> reaction(1);
    constexpr int lost = 300;
    Index least = s.topology.vertex_count;
    for (int tick = 0; tick < 600; ++tick) {
        ASSERT_NO_FATAL_FAILURE(slow.step());
        const auto now = static_cast<std::size_t>(tick % 3);
        const Frame& from = frames[now];
        Frame& to = frames[(now + 1) % 3];
        if (tick == lost) {  // as after a tick that failed: nobody knows what the other frames hold
            for (const std::size_t other : {1U, 2U}) {
                Frame& frame = frames[(now + other) % 3];
                frame.position.setZero();
                frame.previous.setZero();
                frame.velocity.setZero();
                for (Index v = 0; v < s.topology.vertex_count; ++v) {
                    if (s.materials.pinned[static_cast<std::size_t>(v)] == 0) continue;
                    frame.position.col(v) = frame.previous.col(v) = s.frame.position.col(v);
                }
            }
        }
        fast->trust_frames(tick > 0 && tick != lost);
        reaction.assign(1, {});
        ASSERT_TRUE(fast->advance(slow.output, dt, from, to, reaction).ok());
        ASSERT_TRUE(to.position == slow.s.frame.position) << tick;
        ASSERT_TRUE(to.velocity == slow.s.frame.velocity) << tick;
        ASSERT_TRUE(to.previous == slow.s.frame.previous) << tick;
        ASSERT_EQ(fast->largest_move(), slow.stepper->largest_move()) << tick;
        ASSERT_NE(fast->moved(), nullptr);
        Index reported = 0;
        Index end = 0;
        std::vector<std::uint8_t> in(static_cast<std::size_t>(s.topology.vertex_count), 0);
        for (const Range& range : *fast->moved()) {
            ASSERT_GE(range.first, end) << "ascending";
            end = range.end();
            reported += range.count;
            std::fill_n(in.begin() + range.first, range.count, std::uint8_t{1});
        }
        for (Index v = 0; v < s.topology.vertex_count; ++v) {
            ASSERT_TRUE(in[static_cast<std::size_t>(v)] != 0 || to.position.col(v) == from.position.col(v)) << v;
        }
        least = std::min(least, reported);
    }
    EXPECT_LT(least, s.topology.vertex_count / 2) << "most of the tissue is interpolated";
}

TEST(AdaptiveMultires, AFrameOfOthersIsTakenAsItIs) {
    Press p("adaptive_multires", with("0.005"));
    for (int tick = 0; tick < 100; ++tick) p.step();
    p.s.frame = disc().frame;
    p.s.frame.velocity(0, 0) = 0.1;
    p.output.clear();
    std::vector<Wrench> reaction(1);
    ASSERT_TRUE(p.stepper->advance(p.output, dt, p.s.frame, p.s.frame, reaction).ok());
    EXPECT_LT((p.s.frame.position - disc().frame.position).cwiseAbs().maxCoeff(), 1.1e-4);
    EXPECT_GT(p.s.frame.position(0, 0), 0.0);
}

TEST(AdaptiveMultires, VerticesThatSleepMoveAsALinearFieldOfTheNextLevelDoes) {
    MovingTissue tissue(disc().topology, disc().materials);
    tissue.take_over(test::empty_output(disc().topology), disc().frame);
    WrittenVertices written(tissue.state());
    BodyBoxes boxes(disc().topology);
    const RegionTissue region(tissue, written, boxes, disc().topology, disc().frame.position, 300);
    const NodeLevel& vertices = region.levels()[0];
    const NodeLevel& nodes = region.levels()[1];
    int met = 0;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        double sum = 0.0;
        Vector3 place = Vector3::Zero();
        for (std::size_t n = 0; n < 3; ++n) {
            const double weight = vertices.weight[v][n];
            EXPECT_GE(weight, 0.0) << v;
            sum += weight;
            place += weight * nodes.rest[at(vertices.parent[v][n])];
        }
        EXPECT_NEAR(sum, 1.0, 1e-12) << v;
        // At the rim no three nodes need lie around a vertex; shares that are next to nothing are left out.
        if (vertices.rest[v].norm() > 0.7 * radius) continue;
        EXPECT_LT((place - vertices.rest[v]).norm(), 0.01 * edge) << v;
        ++met;
    }
    EXPECT_GT(met, 1000);
}

TEST(AdaptiveMultires, WhatStartsInterpolatedIsPulledByTheForcesOfItsVerticesByTheirWeights) {
    test::TissueSample s = disc();
    std::mt19937 random(2);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (Index v = 0; v < s.topology.vertex_count; ++v) {
        s.materials.rest_bias.col(v) = 1e-2 * test::random_vector(number, random);
        s.frame.position.col(v) += 0.1 * edge * test::random_vector(number, random);
    }
    MovingTissue tissue(s.topology, s.materials);
    tissue.take_over(test::empty_output(s.topology), s.frame);
    WrittenVertices written(tissue.state());
    BodyBoxes boxes(s.topology);
    RegionTissue region(tissue, written, boxes, s.topology, disc().frame.position, 30);
    region.start();
    Matrix3X force;
    internal_force(s.materials, s.frame.position, s.frame.velocity, force);
    std::vector<Vector3> fine;
    for (const Index v : tissue.state().vertex) fine.emplace_back(force.col(v));
    const std::vector<NodeLevel>& levels = region.levels();
    ASSERT_GE(levels.size(), 3U);
    for (std::size_t level = 1; level < levels.size(); ++level) {
        const NodeLevel& below = levels[level - 1];
        const NodeLevel& here = levels[level];
        std::vector<Vector3> coarse(here.size(), Vector3::Zero());
        for (std::size_t node = 0; node < below.size(); ++node) {
            for (std::size_t n = 0; n < 3; ++n) {
                coarse[at(below.parent[node][n])] += below.weight[node][n] * fine[node];
            }
        }
        double largest = 0.0;
        for (const Vector3& one : coarse) largest = std::max(largest, one.norm());
        EXPECT_GT(largest, 1e-3);
        for (std::size_t node = 0; node < here.size(); ++node) {
            if (here.fixed[node] != 0) continue;  // what springs between held vertices pull is nobody's
            EXPECT_LT((here.force.col(eigen_index(node)).head<3>() - coarse[node]).norm(), 1e-10 * largest)
                << "level " << level << ", node " << node;
        }
        fine = coarse;
    }
}

TEST(AdaptiveMultires, ReportsTheLargestStretchAlsoOfWhatNothingHasTouched) {
    // All springs are a quarter longer than at rest and one by half, under one tension: the lattice rests as it is.
    constexpr double k = 100.0;
    constexpr double tension = 0.04;  // N
    test::TissueSample s = test::make_disc(0.02, edge, k, 0.0, mass);
    Spring* longest = nullptr;
    for (Spring& spring : s.materials.springs) {
        spring.rest = edge / 1.25;
        spring.preload = tension - k * (edge - spring.rest);
        if (s.materials.pinned[at(spring.i)] == 0 && s.materials.pinned[at(spring.j)] == 0) longest = &spring;
    }
    ASSERT_NE(longest, nullptr);
    longest->rest = edge / 1.5;
    longest->preload = tension - k * (edge - longest->rest);
    test::Stepped p(s, make_stepper("adaptive_multires", with("0.05")));
    // Two of some 360 vertices are examined in a tick.
    for (int tick = 0; tick < 420; ++tick) {
        ASSERT_TRUE(p.advance().ok());
        EXPECT_LT(p.stepper->max_strain(), 0.5 + 1e-9);
    }
    EXPECT_NEAR(p.stepper->max_strain(), 0.5, 1e-9);
}

TEST(AdaptiveMultires, AFaceUnderASurfaceThatIsDrawnAwayHasFrictionByCoulombsLaw) {
    // Three vertices far from the middle, pressed down by 1 mm. The surface goes on by ten millimetres; sticking ends
    // within one.
    test::TissueSample s = disc();
    test::Stepped p(s, make_stepper("adaptive_multires", with("0.05")));
    std::vector<Index> near(static_cast<std::size_t>(p.s.topology.vertex_count));
    std::iota(near.begin(), near.end(), 0);
    const auto distance = [](Index v) { return (disc().frame.position.col(v) - Vector3(0.02, 0.01, 0.0)).norm(); };
    std::sort(near.begin(), near.end(), [&](Index a, Index b) { return distance(a) < distance(b); });
    for (int tick = 0; tick < 200; ++tick) {
        p.output.clear();
        ContactForceLaw contact = test::plane_contact(near[0], -Vector3::UnitZ(), 0.0, 140.0, 0.0);
        contact.vertices = {near[0], near[1], near[2]};
        contact.weights = {0.5, 0.3, 0.2};
        double z = 0.0;
        for (std::size_t i = 0; i < 3; ++i) z += contact.weights[i] * p.s.frame.position(2, contact.vertices[i]);
        contact.gap = -std::min(0.001, 1e-5 * (tick + 1)) - z;
        contact.reaction_body = 0;
        contact.friction = 0.3;
        contact.tangent_k = 140.0;
        contact.slip_key = near[0];
        contact.surface_velocity = Vector3(0.05, 0.0, 0.0);
        p.output.contacts.push_back(contact);
        ASSERT_TRUE(p.advance().ok());
    }
    const double normal = p.stepper->contact_forces()[0].normal;
    EXPECT_GT(normal, 0.01);
    EXPECT_NEAR(p.stepper->contact_forces()[0].friction, 0.3 * normal, 2e-3 * normal);
    EXPECT_LT((p.reaction[0].force - Vector3(-0.3 * normal, 0.0, normal)).norm(), 0.01 * normal)
        << "drawn back, and pushed up: " << p.reaction[0].force.transpose();
}

/// In one tick from rest, whatever slides, sticks, lifts off or changes the face that presses most meanwhile.
TEST(AdaptiveMultires, FacesThatShareAGripRubByCoulombsLaw) {
    std::mt19937 random(9);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    int slides = 0;
    int sticks = 0;
    for (int round = 0; round < 40; ++round) {
        const double k = std::pow(10.0, 2.0 + 0.1 * (round % 20));
        ResponseOutput output = many_contacts(k, false, random);
        const std::size_t count = output.contacts.size();
        const double speed = std::pow(10.0, 1.5 * number(random) - 2.5);
        for (std::size_t c = 0; c < count; ++c) {
            ContactForceLaw& contact = output.contacts[c];
            contact.friction = 0.3;
            contact.tangent_k = k;
            contact.slip_key = contact.vertices[0];
            contact.surface_velocity = speed * Vector3(number(random), number(random), 0.0);
            ContactForceLaw other = contact;
            other.normal = (contact.normal + 0.2 * Vector3(number(random), number(random), 0.0)).normalized();
            output.contacts.push_back(other);
        }
        test::TissueSample s;
        const std::vector<ContactForce> given =
            given_at_once("adaptive_multires", {{"whole", "0"}, {"tolerance", "1e-8"}}, output, s);
        double largest = 0.0;
        for (const ContactForce& load : given) largest = std::max(largest, load.normal);
        for (std::size_t c = 0; c < count; ++c) {
            const double most = 0.3 * (given[c].normal + given[c + count].normal);
            if (most == 0.0) continue;
            const std::size_t holds = given[c].friction > 0.0 ? c : c + count;
            const ContactForceLaw& contact = output.contacts[holds];
            const Index vertex = contact.vertices[0];
            const Vector3 past = s.frame.velocity.col(vertex) - contact.surface_velocity;
            const double along = (past - past.dot(contact.normal) * contact.normal).norm();
            // A spring with a critical damper, stretched by this step alone.
            const double sticking =
                (2.0 * std::sqrt(k * s.materials.mass[static_cast<std::size_t>(vertex)]) + dt * k) * along;
            EXPECT_NEAR(given[c].friction + given[c + count].friction, std::min(sticking, most), 1e-3 * largest)
                << round << ", vertex " << vertex;
            (sticking < most ? sticks : slides) += 1;
        }
    }
    EXPECT_GT(sticks, 200);
    EXPECT_GT(slides, 800);
}

TEST(AdaptiveMultires, AsksForNoMemoryHoweverMuchIsPushedAtOnce) {
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    // So many vertices that the nodes they move with have a level above them in turn, and are walked over as well.
    test::TissueSample s = test::make_disc(radius, 0.0016, 100.0, 0.2, mass);
    test::Stepped p(s, make_stepper("adaptive_multires", with("0.05")));
    std::int64_t in_ticks = 0;
    for (int tick = 0; tick < 24; ++tick) {
        if (tick < 20) {
            p.output.held_force(2, 0) = -1e-4;
        } else {
            p.output.held_force.row(2).setConstant(-1e-5);
        }
        const std::int64_t before = allocation_count();
        const Outcome outcome = p.advance();
        if (tick >= 20) in_ticks += allocation_count() - before;
        ASSERT_TRUE(outcome.ok()) << outcome.message;
    }
    EXPECT_EQ(in_ticks, 0);
}

TEST(AdaptiveMultires, SlicesOfOneVertexShowAllOfAStringInTurn) {
    // A string of 23 springs under tension that is loaded across between its 2nd and 3rd: straight on both sides of the
    // load, F e 2 21 / (23 T) aside there. A sixteenth of its vertices is one, and what lies beyond three rings is
    // interpolated.
    constexpr Index count = 24;
    constexpr Index loaded = 2;
    constexpr double tension = 0.04;  // N
    constexpr double load = 1e-4;     // N
    test::TissueSample s = test::make_chain(count, mass, {.rest = edge, .k = 100.0, .preload = tension});
    s.materials.drag.assign(at(count), 60.0 * mass);
    test::Stepped p(s, make_stepper("adaptive_multires", with("0.08")));
    p.output.held_force(2, loaded) = load;
    for (int tick = 0; tick < 800; ++tick) {
        const Matrix3X before = p.s.frame.position;
        ASSERT_TRUE(p.advance().ok());
        int shown = 0;
        for (Index v = 10; v < count; ++v) shown += p.s.frame.position.col(v) == before.col(v) ? 0 : 1;
        ASSERT_LE(shown, 1) << tick;
    }
    const double aside = load * edge * loaded * (count - 1 - loaded) / (tension * (count - 1));
    for (Index v = 1; v + 1 < count; ++v) {
        const double part =
            v <= loaded ? static_cast<double>(v) / loaded : static_cast<double>(count - 1 - v) / (count - 1 - loaded);
        EXPECT_NEAR(p.s.frame.position(2, v), part * aside, 0.01 * aside) << v;
    }
}

TEST(AdaptiveMultires, EveryLevelIsAsStiffAndAsDampedAsIsInterpolatedBelowIt) {
    // Any field of the nodes of a level costs in the level's own edges what it costs in those below whose ends both
    // sleep, where these move by their shares: of springs the slope along and the tension over the length across, where
    // they pull, and their dampers along. Vertices that lie on each other have no direction between them.
    test::TissueSample s = disc();
    std::mt19937 random(4);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (Spring& spring : s.materials.springs) {
        spring.k *= 1.0 + 0.5 * number(random);
        spring.preload = 0.04 * number(random);
        spring.damping = 0.1 * (1.0 + number(random));
    }
    for (std::size_t e = 0; e < s.materials.springs.size(); e += 97) {
        const Spring& spring = s.materials.springs[e];
        if (s.materials.pinned[at(spring.i)] != 0 || s.materials.pinned[at(spring.j)] != 0) continue;
        s.frame.position.col(spring.j) = s.frame.position.col(spring.i);
    }
    MovingTissue tissue(s.topology, s.materials);
    tissue.take_over(test::empty_output(s.topology), s.frame);
    WrittenVertices written(tissue.state());
    BodyBoxes boxes(s.topology);
    RegionTissue region(tissue, written, boxes, s.topology, s.frame.position, 30);
    region.start();
    const std::vector<NodeLevel>& levels = region.levels();
    ASSERT_GE(levels.size(), 3U);
    using Blocks = std::array<Matrix3, 2>;  // N/m and N s/m
    const auto blocks_of = [&](std::size_t level, std::size_t e) {
        Blocks blocks{Matrix3::Zero(), Matrix3::Zero()};
        if (level > 0) {
            blocks[0] = full(levels[level].stiffness[e]);
            blocks[1] = full(levels[level].damping[e]);
            return blocks;
        }
        const Spring& spring = tissue.springs()[e];
        const Vector3 path = s.frame.position.col(spring.j) - s.frame.position.col(spring.i);
        const double length = path.norm();
        if (length == 0.0) return blocks;
        const Matrix3 along = path * path.transpose() / (length * length);
        const double pull = std::max(0.0, spring.preload + spring.k * (length - spring.rest));
        blocks[0] = spring.k * along + pull / length * (Matrix3::Identity() - along);
        blocks[1] = spring.damping * along;
        return blocks;
    };
    const auto compare = [&](const char* when) {
        for (std::size_t level = 1; level < levels.size(); ++level) {
            const NodeLevel& below = levels[level - 1];
            const NodeLevel& here = levels[level];
            std::vector<Vector3> field;
            for (std::size_t n = 0; n < here.size(); ++n) field.push_back(test::random_vector(number, random));
            const auto moved = [&](Index node) {
                Vector3 sum = Vector3::Zero();
                for (std::size_t n = 0; n < 3; ++n) {
                    sum += below.weight[at(node)][n] * field[at(below.parent[at(node)][n])];
                }
                return sum;
            };
            std::array<double, 2> expected{};
            std::array<double, 2> found{};
            for (std::size_t e = 0; e < below.i.size(); ++e) {
                if (below.active[at(below.i[e])] != 0 || below.active[at(below.j[e])] != 0) continue;
                const Vector3 apart = moved(below.i[e]) - moved(below.j[e]);
                const Blocks blocks = blocks_of(level - 1, e);
                for (std::size_t n = 0; n < 2; ++n) expected[n] += apart.dot(blocks[n] * apart);
            }
            for (std::size_t e = 0; e < here.i.size(); ++e) {
                const Vector3 apart = field[at(here.i[e])] - field[at(here.j[e])];
                const Blocks blocks = blocks_of(level, e);
                for (std::size_t n = 0; n < 2; ++n) found[n] += apart.dot(blocks[n] * apart);
            }
            for (std::size_t n = 0; n < 2; ++n) {
                EXPECT_GT(expected[n], 0.0);
                EXPECT_NEAR(found[n], expected[n], 1e-9 * expected[n]) << when << ", level " << level << ", " << n;
            }
        }
    };
    int without_length = 0;
    for (std::size_t e = 0; e < levels[0].i.size(); ++e) {
        const std::array<double, 3>& weight = levels[0].weight[at(levels[0].i[e])];
        const bool is_spread = std::count(weight.begin(), weight.end(), 0.0) < 2;
        without_length += is_spread && blocks_of(0, e)[0].isZero(0.0) ? 1 : 0;
    }
    EXPECT_GT(without_length, 5) << "or nothing is said of them";
    compare("asleep");
    for (const std::size_t level : {0U, 1U}) {
        const double woken = level == 0 ? 0.006 : 0.012;  // m, around the middle
        for (Index node = 0; at(node) < levels[level].size(); ++node) {
            if (levels[level].rest[at(node)].norm() < woken) region.activate(level, node);
        }
        EXPECT_GT(levels[level].active_nodes.size(), 2U);
        compare("some active");
    }
    for (const std::size_t level : {0U, 1U}) {
        const std::vector<Index> active = levels[level].active_nodes;
        for (std::size_t n = 0; n < active.size(); n += 2) region.interpolate(level, active[n]);
        compare("some interpolated again");
    }
}

TEST(AdaptiveMultires, CoulombsLawHoldsHoweverSmallTheForcesAre) {
    // Of a mass on a plane under 0.5 N, friction 0.4: 0.15 N along it stretch a spring of 2000 N/m, 0.3 N leave 0.1 N
    // for 1 g. Where mass, forces and springs are so many times larger, so is the friction and nothing else.
    const auto hold = [](double size, double along, const char* tolerance, double bound) {
        test::Stepped p(test::make_tissue({Vector3::Zero()}, {1e-3 * size}, {0}, {}),
                        make_stepper("adaptive_multires", {{"whole", "0"}, {"tolerance", tolerance}}));
        ASSERT_NO_FATAL_FAILURE(test::press_and_pull(p, along, size));
        const ContactForce& load = p.stepper->contact_forces()[0];
        EXPECT_NEAR(load.normal, 0.5 * size, bound * size) << size << ", " << tolerance;
        EXPECT_NEAR(load.friction, std::min(along, 0.2) * size, 1e-3 * size) << size << ", " << along;
        if (along < 0.2) {
            EXPECT_NEAR(p.s.frame.position(0, 0), along / 2000.0, 1e-6) << size;
        } else {
            EXPECT_NEAR(p.s.frame.velocity(0, 0), 100.0 * 0.4, 0.4) << size;
        }
    };
    for (const double size : {1e-5, 1.0, 1e3}) {
        for (const double along : {0.15, 0.3}) {
            hold(size, along, "0.002", 1e-3);  // the default
            hold(size, along, "1e-4", 1e-4);
        }
    }
}

}  // namespace
}  // namespace trocar
