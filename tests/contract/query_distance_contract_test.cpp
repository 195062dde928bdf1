// What a detector owes that answers within a query distance: exactly the pairs of triangles at most the query distance
// apart, those that meet in one list and the near ones in the other. One that does not is held to saying so.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "contract/contract_support.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar::test {
namespace {

// ---- what is expected ----

/// Every pair of triangles that do not meet and may be within `query_distance`, with its distance; by a double loop.
struct Near {
    Pairs pairs;                    ///< certainly within the query distance
    std::set<TrianglePair> either;  ///< within 1e-9 of it, relatively: rounding decides
};

Near expected_near(const World& world, double query_distance) {
    Near near;
    if (query_distance == 0.0) return near;
    constexpr double slack = 1e-9;
    for (const auto& [first, second] : world.topology.body_pairs) {
        const Range a_range = world.topology.bodies[static_cast<std::size_t>(first)].triangles;
        const Range b_range = world.topology.bodies[static_cast<std::size_t>(second)].triangles;
        std::vector<Corners> others;
        std::vector<Box> boxes;
        for (Index b = b_range.first; b < b_range.end(); ++b) {
            others.push_back(corners_of(world, b));
            boxes.emplace_back();
            for (const Vector3& corner : others.back()) boxes.back().add(corner);
        }
        for (Index a = a_range.first; a < a_range.end(); ++a) {
            const Corners one = corners_of(world, a);
            Box around;
            for (const Vector3& corner : one) around.add(corner);
            around.min.array() -= 2.0 * query_distance;
            around.max.array() += 2.0 * query_distance;
            for (Index b = b_range.first; b < b_range.end(); ++b) {
                const auto k = static_cast<std::size_t>(b - b_range.first);
                if (!around.overlaps(boxes[k])) continue;
                const double distance = std::sqrt(triangle_distance(one, others[k]).squared_distance);
                if (triangles_intersect(one, others[k])) continue;
                if (std::abs(distance - query_distance) <= slack * query_distance) {
                    near.either.insert({a, b});
                } else if (distance < query_distance) {
                    near.pairs.push_back({a, b});
                }
            }
        }
    }
    std::sort(near.pairs.begin(), near.pairs.end());
    return near;
}

/// Empty when the answer is what is expected within its query distance, else how it differs. A pair that the detector
/// wrongly takes for meeting is a matter of the other contract.
std::string difference(const std::string& where, const ContactSet& contacts, const Near& expected, const Pairs& meeting,
                       double query_distance) {
    const std::string here = fmt::format("{}, query distance {:g}", where, query_distance);
    if (!contacts.outcome.ok()) {
        return fmt::format("{}: outcome {} ({})\n", here, name_of(contacts.outcome.kind), contacts.outcome.message);
    }
    std::string failures;
    if (contacts.truncated) failures += here + ": truncated\n";
    if (contacts.query_distance != query_distance)
        failures += fmt::format("{}: answered within {:g}\n", here, contacts.query_distance);
    if (contacts.pairs != meeting) failures += here + ": other meeting pairs than at query distance 0\n";
    if (!std::is_sorted(contacts.near.begin(), contacts.near.end()) ||
        std::adjacent_find(contacts.near.begin(), contacts.near.end()) != contacts.near.end()) {
        return failures + here + ": near pairs out of order, or one twice\n";
    }
    Pairs missing;
    Pairs extra;
    std::set_difference(expected.pairs.begin(), expected.pairs.end(), contacts.near.begin(), contacts.near.end(),
                        std::back_inserter(missing));
    std::set_difference(contacts.near.begin(), contacts.near.end(), expected.pairs.begin(), expected.pairs.end(),
                        std::back_inserter(extra));
    std::erase_if(missing, [&](const TrianglePair& pair) {
        return std::binary_search(contacts.pairs.begin(), contacts.pairs.end(), pair);
    });
    std::erase_if(extra, [&](const TrianglePair& pair) { return expected.either.contains(pair); });
    for (const TrianglePair& pair : contacts.near) {
        if (std::binary_search(contacts.pairs.begin(), contacts.pairs.end(), pair)) {
            failures += fmt::format("{}: ({}, {}) in both lists\n", here, pair.a, pair.b);
        }
    }
    if (!missing.empty() || !extra.empty()) {
        failures += fmt::format("{}: {} of {} near pairs missing, {} extra, {} reported\n", here, missing.size(),
                                expected.pairs.size(), extra.size(), contacts.near.size());
    }
    return failures;
}

// ---- scenes and query distances ----

double mean_edge(const World& world) {
    double sum = 0.0;
    for (Index t = 0; t < world.topology.triangle_count(); ++t) {
        const Corners c = corners_of(world, t);
        for (std::size_t k = 0; k < 3; ++k) sum += (c[(k + 1) % 3] - c[k]).norm();
    }
    return sum / (3.0 * std::max<Index>(1, world.topology.triangle_count()));
}

/// 0, 0.1 and 1 mean edge; ten edges where there are few triangles.
std::vector<double> reaches(const World& world) {
    const double edge = mean_edge(world);
    std::vector<double> list{0.0, 0.1 * edge, edge};
    if (world.topology.triangle_count() < 200) list.push_back(10.0 * edge);
    return list;
}

/// Bodies that do not meet: a hand's breadth, an edge, or less apart.
std::vector<World> apart_scenes() {
    return {make_world("sphere over a sheet", {{BodyKind::instrument, sphere(0.03, 14).move({0.003, 0.001, 0.0309})},
                                               {BodyKind::tissue, sheet(0.1, 20).shake(0.0002, 1)}}),
            make_world("two sheets one over the other, many pairs exactly at one distance",
                       {{BodyKind::tissue, sheet(0.125, 8)},
                        {BodyKind::tissue, sheet(0.125, 8).move({0.0, 0.0, 0.00390625})}}),
            make_world("two triangles far apart",
                       {{BodyKind::tissue, triangle({0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0})},
                        {BodyKind::rigid, triangle({0.09, 0, 0}, {0.1, 0, 0}, {0.09, 0.01, 0.01})}}),
            make_world("small bodies of three kinds",
                       {{BodyKind::instrument, sphere(0.004, 5).move({0.0, 0.0, 0.009})},
                        {BodyKind::tissue, sheet(0.03, 4).shake(0.0003, 3)},
                        {BodyKind::rigid, slab(0.02, 0.003, 3).move({0.002, 0.0, -0.006})}})};
}

std::string exactly_within(const DetectorEntry& entry, const World& world, const std::vector<double>& list,
                           const Settings& settings = {}) {
    const Pairs meeting = answer_of(entry, world, settings).pairs;
    std::string failures;
    for (const double query_distance : list) {
        failures += difference(world.name, answer_of(entry, world, settings, false, query_distance),
                               expected_near(world, query_distance), meeting, query_distance);
    }
    return failures;
}

std::string exactly_within(const DetectorEntry& entry, const std::vector<World>& worlds) {
    return over(worlds, [&entry](const World& world) { return exactly_within(entry, world, reaches(world)); });
}

// ---- checks: empty text = kept ----

std::string general(const DetectorEntry& entry) { return exactly_within(entry, general_scenes()); }
std::string apart(const DetectorEntry& entry) {
    return over(apart_scenes(), [&entry](const World& world) {
        const double most = reaches(world).back();
        if (expected_near(world, most).pairs.empty()) return world.name + ": no near pair, nothing is tested\n";
        return exactly_within(entry, world, reaches(world));
    });
}
std::string long_triangles(const DetectorEntry& entry) { return exactly_within(entry, long_triangle_scenes()); }
std::string touching(const DetectorEntry& entry) { return exactly_within(entry, touching_scenes()); }
std::string zero_area(const DetectorEntry& entry) { return exactly_within(entry, zero_area_scenes()); }
std::string seventy_bodies(const DetectorEntry& entry) { return exactly_within(entry, {many_bodies()}); }
std::string other_sizes_and_places(const DetectorEntry& entry) {
    return exactly_within(entry, {moved(sphere_in_sheet(), {1e4, -2e4, 1.5e4}), scaled(shaft_in_slab(), 1e-5),
                                  scaled(sphere_in_sheet(), 1e5)});
}

std::string swapped_bodies(const DetectorEntry& entry) {
    const World world = shaft_in_slab();
    const Permutation swapped = with_bodies_in_order(world.topology, {1, 0});
    std::string failures;
    for (const double query_distance : reaches(world)) {
        failures += difference("swapped", permuted_answer(entry, world, swapped, query_distance),
                               expected_near(world, query_distance), answer_of(entry, world).pairs, query_distance);
    }
    return failures;
}

std::string order_of_triangles(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const double query_distance = 0.3 * mean_edge(world);
        const Permutation other = shuffled(world.topology, 1, Shuffle::triangles_and_vertices);
        return difference(world.name, permuted_answer(entry, world, other, query_distance),
                          expected_near(world, query_distance), answer_of(entry, world).pairs, query_distance);
    });
}

std::string exact_translation(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const World here{world.name, world.topology, on_grid(world.frame)};
        const World there = moved(here, {16.0, -8.0, 4.0});
        const double query_distance = 0.3 * mean_edge(world);
        return difference(world.name, answer_of(entry, there, {}, false, query_distance),
                          expected_near(here, query_distance), answer_of(entry, here).pairs, query_distance);
    });
}

/// Body 0 travels and turns, the others ripple or rest; the query distance grows, shrinks, is 0 in between; ranges are
/// reported every other time.
std::string moving_bodies_and_changing_query_distance(const DetectorEntry& entry) {
    std::vector<World> worlds{sphere_in_sheet(), shaft_in_slab()};
    worlds.push_back(general_scenes().back());
    for (const World& world : apart_scenes()) worlds.push_back(world);
    return over(worlds, [&entry](World world) {
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        const double edge = mean_edge(world);
        const double factors[] = {0.1, 0.1, 0.0, 0.2, 0.8, 0.8, 0.1, 0.1, 0.0, 0.0, 0.4, 0.05, 0.1, 0.1};
        std::string failures;
        int tick = 0;
        for (const double factor : factors) {
            const double query_distance = factor * edge;
            world.frame.previous = world.frame.position;
            const BodyRange& body = world.topology.bodies[0];
            const Matrix3 turn = Eigen::AngleAxisd(0.03, Vector3(1, 1, 0).normalized()).toRotationMatrix();
            const bool all_move = tick % 4 == 1;
            if (tick % 5 != 4) {  // and nothing moves at all now and then
                for (Index v = 0; v < world.topology.vertex_count; ++v) {
                    Vector3 x = world.frame.position.col(v);
                    if (body.vertices.contains(v)) {
                        x = turn * x + Vector3(0.0007, -0.0005, -0.0006);
                    } else if (all_move) {
                        x += 0.0002 * Vector3(std::sin(90 * x[1]), std::sin(80 * x[2]), std::sin(70 * x[0] + tick));
                    }
                    world.frame.position.col(v) = x;
                }
            }
            world.frame.moved.reset();
            if (tick % 2 == 1) {
                world.frame.moved.emplace();
                if (tick % 5 != 4) world.frame.moved->push_back(body.vertices);
                if (tick % 5 != 4 && all_move) {
                    world.frame.moved->push_back(
                        {body.vertices.end(), world.topology.vertex_count - body.vertices.end()});
                }
            }
            ++world.frame.tick;
            world.frame.time += 0.001;
            World fresh = world;
            fresh.frame.moved.reset();
            failures += difference(fmt::format("{}, tick {}", world.name, tick),
                                   answer(*detector, world, false, query_distance),
                                   expected_near(fresh, query_distance), answer_of(entry, fresh).pairs, query_distance);
            ++tick;
        }
        return failures;
    });
}

/// Nothing moves, which the frames report or do not.
std::string query_distance_that_grows_over_bodies_at_rest(const DetectorEntry& entry) {
    std::vector<World> worlds = apart_scenes();
    worlds.push_back(shaft_in_slab());
    return over(worlds, [&entry](const World& world) {
        std::string failures;
        const Pairs meeting = answer_of(entry, world).pairs;
        const double most = reaches(world).back();
        for (const bool reported : {false, true}) {
            World resting = world;
            if (reported) resting.frame.moved.emplace();
            const auto detector = make(entry);
            detector->prepare(world.topology, world.frame);
            for (const double query_distance : {0.0, 0.0, 0.0, most, most, 0.1 * most, 0.0, 0.0, 0.2 * most}) {
                failures += difference(world.name, answer(*detector, resting, false, query_distance),
                                       expected_near(world, query_distance), meeting, query_distance);
                ++resting.frame.tick;
            }
        }
        return failures;
    });
}

/// A bump rises from a sheet under a resting sphere and sinks again, in steps far below a cell.
std::string body_that_moves_in_part(const DetectorEntry& entry) {
    std::string failures;
    for (const int quads : {8, 20}) {  // the sheet has fewer triangles than the sphere, and more
        World world =
            make_world("bump under a sphere", {{BodyKind::instrument, sphere(0.03, 12).move({0.003, 0.001, 0.036})},
                                               {BodyKind::tissue, sheet(0.1, quads).shake(0.0002, 1)}});
        const double query_distance = 0.2 * mean_edge(world);
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        const Range sheet_vertices = world.topology.bodies[1].vertices;
        std::size_t most = 0;
        for (int tick = 0; tick < 60; ++tick) {
            world.frame.previous = world.frame.position;
            for (Index v = sheet_vertices.first; v < sheet_vertices.end(); ++v) {
                if (world.frame.position.col(v).head<2>().norm() > 0.02) continue;
                world.frame.position(2, v) += (tick < 30 ? 0.00023 : -0.00023) * (1 + v % 2);
            }
            ++world.frame.tick;
            const ContactSet contacts = answer(*detector, world, false, query_distance);
            most = std::max(most, contacts.near.size());
            failures += difference(fmt::format("{} quads, tick {}", quads, tick), contacts,
                                   expected_near(world, query_distance), answer_of(entry, world).pairs, query_distance);
        }
        if (most < 5) failures += "too few near pairs for a test\n";
    }
    return failures;
}

/// Long triangles that come from afar within the tick and end near others without meeting them.
std::string bodies_that_come_from_afar(const DetectorEntry& entry) {
    std::string failures;
    for (const double jump : {0.05, 0.4, 3.0}) {
        World world = make_world("shaft that comes from afar",
                                 {{BodyKind::instrument,
                                   shaft(0.004, 0.3, 12, 1).rotate({0.0, 1.0, 0.0}, 1.57).move({-0.15, 0.001, 0.0053})},
                                  {BodyKind::tissue, sheet(0.1, 24).shake(0.0001, 7)}});
        const Range vertices = world.topology.bodies[0].vertices;
        world.frame.previous = world.frame.position;
        world.frame.previous.middleCols(vertices.first, vertices.count).colwise() += Vector3(0.1 * jump, 0.0, jump);
        const double query_distance = 0.002;
        const Near expected = expected_near(world, query_distance);
        if (expected.pairs.size() < 10) failures += "too few near pairs for a test\n";
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        failures += difference(fmt::format("jump {}", jump), answer(*detector, world, false, query_distance), expected,
                               answer_of(entry, world).pairs, query_distance);
    }
    return failures;
}

std::string not_finite_is_reported(const DetectorEntry& entry) {
    const World good = sphere_in_sheet();
    World bad = good;
    bad.frame.position(1, 17) = std::numeric_limits<double>::quiet_NaN();
    const double query_distance = 0.2 * mean_edge(good);
    const auto detector = make(entry);
    detector->prepare(good.topology, good.frame);
    (void)answer(*detector, good, false, query_distance);
    const ContactSet contacts = answer(*detector, bad, false, query_distance);
    std::string failures;
    if (contacts.outcome.kind != OutcomeKind::not_finite || !contacts.pairs.empty() || !contacts.near.empty()) {
        failures += fmt::format("outcome {}, {} near\n", name_of(contacts.outcome.kind), contacts.near.size());
    }
    return failures + difference("after", answer(*detector, good, false, query_distance),
                                 expected_near(good, query_distance), answer_of(entry, good).pairs, query_distance);
}

std::string same_answer_twice(const DetectorEntry& entry) {
    return over({sphere_in_sheet(), shaft_in_slab()}, [&entry](const World& world) {
        const double query_distance = 0.2 * mean_edge(world);
        const ContactSet first = answer_of(entry, world, {}, false, query_distance);
        const ContactSet second = answer_of(entry, world, {}, false, query_distance);
        std::string failures;
        if (first.near != second.near || first.pairs != second.pairs) failures += world.name + ": other pairs\n";
        if (first.work.work() != second.work.work()) failures += world.name + ": other work\n";
        if (entry.own && first.work.work() <= answer_of(entry, world).work.work()) {
            failures += world.name + ": the tests within the query distance are not counted\n";
        }
        return failures;
    });
}

/// A choice may be one that has no query distance; then it says so.
std::string every_choice(const DetectorEntry& entry) {
    std::string failures;
    std::vector<World> worlds = long_triangle_scenes();
    worlds.push_back(shaft_in_slab());
    for (const World& world : worlds) {
        const double query_distance = 0.3 * mean_edge(world);
        const Near expected = expected_near(world, query_distance);
        for (const Parameter& parameter : entry.parameters) {
            std::vector<std::string> values = parameter.choices;
            values.insert(values.end(), parameter.words.begin(), parameter.words.end());
            for (const std::string& value : values) {
                const Settings settings{{parameter.name, value}};
                const ContactSet contacts = answer_of(entry, world, settings, false, query_distance);
                const bool refused = contacts.outcome.kind == OutcomeKind::unsupported;
                if (refused && !contacts.outcome.message.empty() && contacts.near.empty() && !entry.own &&
                    value != parameter.default_value) {
                    continue;
                }
                failures += difference(fmt::format("{} {}={}", world.name, parameter.name, value), contacts, expected,
                                       answer_of(entry, world, settings).pairs, query_distance);
            }
        }
    }
    return failures;
}

bool holds_all(const Pairs& all, const Pairs& some) {
    return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

/// Near pairs count, what is reported is true, and what is cut off is reported.
std::string limits(const DetectorEntry& entry) {
    const World world = shaft_in_slab();
    const double query_distance = 0.3 * mean_edge(world);
    const ContactSet all = answer_of(entry, world, {}, false, query_distance);
    const auto count = static_cast<std::int64_t>(all.pairs.size() + all.near.size());
    std::string failures;
    for (const Parameter& parameter : entry.parameters) {
        const bool by_pairs = parameter.name == "max_pairs";
        if (!by_pairs && parameter.name != "work_budget") continue;
        std::int64_t most = 0;
        for (const double part : {0.0, 0.1, 0.7, 0.99, 1.0, 2.0}) {
            const auto limit = static_cast<std::int64_t>(
                part *
                static_cast<double>(
                    by_pairs ? count
                             : answer_of(entry, world, {{"max_pairs", "1000000"}}, false, query_distance).work.work()));
            const auto detector = make(entry, {{parameter.name, std::to_string(limit)}});
            detector->prepare(world.topology, world.frame);
            for (int tick = 0; tick < 2; ++tick) {
                const ContactSet some = answer(*detector, world, false, query_distance);
                const auto reported = static_cast<std::int64_t>(some.pairs.size() + some.near.size());
                most = std::max(most, reported);
                if (!holds_all(all.pairs, some.pairs) || !holds_all(all.near, some.near) ||
                    (reported < count && !some.truncated) || (by_pairs && reported > limit) ||
                    (!by_pairs && some.work.work() > limit)) {
                    failures += fmt::format("{}={}, tick {}: {} of {} pairs, truncated {}, work {}\n", parameter.name,
                                            limit, tick, reported, count, some.truncated, some.work.work());
                }
            }
        }
        if (most != count) failures += parameter.name + ": never all pairs\n";
    }
    return failures;
}

struct Check {
    const char* name;
    std::string (*run)(const DetectorEntry&);
};
constexpr Check checks[] = {
    {"ExactlyThePairsWithinQueryDistanceInGeneralPosition", general},
    {"ExactlyThePairsWithinQueryDistanceOfBodiesApart", apart},
    {"ExactlyThePairsWithinQueryDistanceOfLongTriangles", long_triangles},
    {"ExactlyThePairsWithinQueryDistanceOfTouchingTriangles", touching},
    {"ExactlyThePairsWithinQueryDistanceOfZeroAreas", zero_area},
    {"ExactlyThePairsWithinQueryDistanceOfSeventyBodies", seventy_bodies},
    {"QueryDistanceHoldsInOtherSizesAndPlaces", other_sizes_and_places},
    {"SwappedBodiesHaveTheSameNearPairs", swapped_bodies},
    {"OrderMakesNoDifferenceToNearPairs", order_of_triangles},
    {"ExactTranslationMakesNoDifferenceToNearPairs", exact_translation},
    {"MovingBodiesAndAChangingQueryDistanceAreFollowed", moving_bodies_and_changing_query_distance},
    {"AQueryDistanceThatGrowsOverBodiesAtRestIsFollowed", query_distance_that_grows_over_bodies_at_rest},
    {"ABodyThatMovesInPartIsFollowedWithinQueryDistance", body_that_moves_in_part},
    {"BodiesThatComeFromAfarHaveTheirNearPairs", bodies_that_come_from_afar},
    {"NotFiniteVertexIsReportedWithinQueryDistance", not_finite_is_reported},
    {"SameNearPairsTwice", same_answer_twice},
    {"LimitsCoverNearPairs", limits},
    {"EveryChoiceHasTheSameNearPairsOrSaysThatItHasNone", every_choice},
};

std::vector<DetectorEntry> within_query_distance() {
    std::vector<DetectorEntry> list = methods();
    std::erase_if(list, [](const DetectorEntry& entry) { return !entry.query_distance; });
    return list;
}

class QueryDistanceContract : public testing::TestWithParam<std::tuple<std::size_t, std::size_t>> {};

TEST_P(QueryDistanceContract, Holds) {
    const auto& [method, number] = GetParam();
    const DetectorEntry entry = within_query_distance()[method];
    const std::string failures = checks[number].run(entry);
    EXPECT_TRUE(failures.empty()) << failures;
}

std::string test_name(const testing::TestParamInfo<std::tuple<std::size_t, std::size_t>>& info) {
    return fmt::format("{}_{}", within_query_distance()[std::get<0>(info.param)].name,
                       checks[std::get<1>(info.param)].name);
}

INSTANTIATE_TEST_SUITE_P(Every, QueryDistanceContract,
                         testing::Combine(testing::Range(std::size_t{0}, within_query_distance().size()),
                                          testing::Range(std::size_t{0}, std::size(checks))),
                         test_name);

TEST(QueryDistanceContractOfOthers, ADetectorWithoutQueryDistanceRefusesOneAndAnswersAsBeforeWithoutIt) {
    const World world = sphere_in_sheet();
    for (const DetectorEntry& entry : methods()) {
        if (entry.query_distance) continue;
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        const ContactSet refused = answer(*detector, world, false, 0.001);
        EXPECT_EQ(refused.outcome.kind, OutcomeKind::unsupported) << entry.name;
        EXPECT_FALSE(refused.outcome.message.empty()) << entry.name;
        EXPECT_TRUE(refused.pairs.empty() && refused.near.empty()) << entry.name;
        const ContactSet again = answer(*detector, world);
        EXPECT_TRUE(again.outcome.ok()) << entry.name << ": " << again.outcome.message;
        EXPECT_EQ(again.pairs, answer_of(entry, world).pairs) << entry.name;
        EXPECT_TRUE(again.near.empty()) << entry.name;
    }
}

}  // namespace
}  // namespace trocar::test
