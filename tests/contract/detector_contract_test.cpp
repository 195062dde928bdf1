// What every registered detector owes its caller, own or foreign: each check runs for each method and is a test of its
// own. What a library is known to get wrong is listed in known_gaps.json with the reason; it must go on failing, or the
// list is out of date.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "contract/contract_support.hpp"

namespace trocar::test {
namespace {

/// Empty when equal, else how the two sets differ.
std::string difference(std::string_view where, const ContactSet& contacts, const Pairs& expected) {
    if (!contacts.outcome.ok()) {
        return fmt::format("{}: outcome {} ({})\n", where, name_of(contacts.outcome.kind), contacts.outcome.message);
    }
    if (contacts.truncated) return fmt::format("{}: truncated\n", where);
    Pairs missing;
    Pairs extra;
    std::set_difference(expected.begin(), expected.end(), contacts.pairs.begin(), contacts.pairs.end(),
                        std::back_inserter(missing));
    std::set_difference(contacts.pairs.begin(), contacts.pairs.end(), expected.begin(), expected.end(),
                        std::back_inserter(extra));
    if (missing.empty() && extra.empty() && contacts.pairs.size() == expected.size()) return {};
    return fmt::format("{}: {} of {} pairs missing, {} extra, {} reported\n", where, missing.size(), expected.size(),
                       extra.size(), contacts.pairs.size());
}

std::string compare(const DetectorEntry& entry, const World& world, const Settings& settings = {}) {
    std::string where = world.name;
    for (const auto& [key, value] : settings) where += fmt::format(" {}={}", key, value);
    return difference(where, answer_of(entry, world, settings), pairs_of_oracle(world));
}

// ---- checks: empty text = kept ----

std::string same_pairs_as_the_oracle(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        if (pairs_of_oracle(world).size() < 10) return world.name + ": too few pairs for a test\n";
        return compare(entry, world);
    });
}
std::string long_triangles(const DetectorEntry& entry) {
    return over(long_triangle_scenes(), [&entry](const World& world) { return compare(entry, world); });
}
std::string touching_pairs_are_found(const DetectorEntry& entry) {
    return over(touching_scenes(), [&entry](const World& world) {
        if (pairs_of_oracle(world).empty()) return world.name + ": too few pairs for a test\n";
        return compare(entry, world);
    });
}
std::string zero_area_triangles_are_found(const DetectorEntry& entry) {
    return over(zero_area_scenes(), [&entry](const World& world) { return compare(entry, world); });
}
std::string seventy_bodies(const DetectorEntry& entry) { return compare(entry, many_bodies()); }

std::string far_from_the_origin(const DetectorEntry& entry) {
    // Rounding at 10 km moves vertices: the oracle sees the moved ones too.
    return over({moved(sphere_in_sheet(), {1e4, -2e4, 1.5e4}), moved(shaft_in_slab(), {-1e4, 0.0, 3e4})},
                [&entry](const World& world) { return compare(entry, world); });
}
std::string micrometre_scene(const DetectorEntry& entry) {
    return over({scaled(sphere_in_sheet(), 1e-5), scaled(shaft_in_slab(), 1e-5)},
                [&entry](const World& world) { return compare(entry, world); });
}
std::string kilometre_scene(const DetectorEntry& entry) {
    return over({scaled(sphere_in_sheet(), 1e5), scaled(shaft_in_slab(), 1e5)},
                [&entry](const World& world) { return compare(entry, world); });
}

std::string order_of_triangles_and_vertices(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const Permutation other = shuffled(world.topology, 1, Shuffle::triangles_and_vertices);
        return difference(world.name, permuted_answer(entry, world, other), answer_of(entry, world).pairs);
    });
}

std::string winding(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        World other = world;
        for (Index t = 0; t < world.topology.triangle_count(); t += 2) {
            std::swap(other.topology.triangles(1, t), other.topology.triangles(2, t));
        }
        return difference(world.name, answer_of(entry, other), answer_of(entry, world).pairs);
    });
}

std::string exact_translation(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const World here{world.name, world.topology, on_grid(world.frame)};
        const World there = moved(here, {16.0, -8.0, 4.0});
        return difference(world.name, answer_of(entry, there), answer_of(entry, here).pairs);
    });
}

std::string swapped_bodies(const DetectorEntry& entry) {
    const World world = shaft_in_slab();
    return difference("swapped", permuted_answer(entry, world, with_bodies_in_order(world.topology, {1, 0})),
                      answer_of(entry, world).pairs);
}

std::string update_equals_fresh_prepare(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](World world) {
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        std::string failures;
        for (int tick = 0; tick < 6; ++tick) {
            // Body 0 travels and turns, the others ripple; at tick 3 everything jumps.
            const BodyRange& body = world.topology.bodies[0];
            world.frame.previous = world.frame.position;
            const Matrix3 turn = Eigen::AngleAxisd(0.05, Vector3(1, 1, 0).normalized()).toRotationMatrix();
            for (Index v = 0; v < world.topology.vertex_count; ++v) {
                Vector3 x = world.frame.position.col(v);
                if (body.vertices.contains(v)) {
                    x = turn * x + Vector3(0.001, -0.0005, -0.001);
                } else {
                    x += 0.0004 * Vector3(std::sin(90 * x[1]), std::sin(80 * x[2]), std::sin(70 * x[0] + tick));
                }
                if (tick == 3) x += Vector3(0.3, -0.1, 0.2);
                world.frame.position.col(v) = x;
            }
            if (tick == 3) world.frame.previous = world.frame.position;  // put there: no way to be followed
            ++world.frame.tick;
            world.frame.time += 0.001;
            const ContactSet followed = answer(*detector, world);
            failures +=
                difference(fmt::format("{}, tick {}", world.name, tick), followed, answer_of(entry, world).pairs);
        }
        return failures;
    });
}

std::string moved_ranges_are_honoured(const DetectorEntry& entry) {
    // Frames that say what moved: first nothing, then part of one body, then the other body.
    World world = shaft_in_slab();
    const auto detector = make(entry);
    detector->prepare(world.topology, world.frame);
    std::string failures = difference("first", answer(*detector, world), answer_of(entry, world).pairs);
    const Range tool = world.topology.bodies[0].vertices;
    const Range tissue = world.topology.bodies[1].vertices;
    for (int tick = 1; tick < 7; ++tick) {
        world.frame.previous = world.frame.position;
        std::vector<Range> ranges;
        if (tick == 2) ranges = {{tissue.first + 40, 30}};
        if (tick == 3) ranges = {tool};
        if (tick == 5) ranges = {tool, {tissue.first, 100}};
        if (tick == 6) ranges = {{tool.first, tool.count + tissue.count}};
        for (const Range& range : ranges) {
            for (Index v = range.first; v < range.end(); ++v) {
                world.frame.position.col(v) += Vector3(0.0007, -0.0003, -0.0011 * (v % 3));
            }
        }
        world.frame.moved = ranges;
        ++world.frame.tick;
        World plain = world;
        plain.frame.moved.reset();
        failures += difference(fmt::format("tick {}", tick), answer(*detector, world), answer_of(entry, plain).pairs);
    }
    return failures;
}

std::string empty_scenes(const DetectorEntry& entry) {
    const Shape nothing;
    Shape points;
    points.vertices = {{0, 0, 0}, {1, 0, 0}};
    std::vector<World> worlds;
    worlds.push_back(make_world("no bodies", {}));
    worlds.push_back(make_world("one body", {{BodyKind::tissue, sheet(0.1, 3)}}));
    worlds.push_back(make_world("an empty body", {{BodyKind::tissue, sheet(0.1, 3)}, {BodyKind::instrument, nothing}}));
    worlds.push_back(make_world("two empty bodies", {{BodyKind::tissue, nothing}, {BodyKind::instrument, nothing}}));
    worlds.push_back(
        make_world("a body without triangles", {{BodyKind::tissue, sheet(0.1, 3)}, {BodyKind::instrument, points}}));
    worlds.push_back(
        make_world("only rigid bodies", {{BodyKind::rigid, sheet(0.1, 3)}, {BodyKind::rigid, sheet(0.1, 3)}}));
    return over(worlds, [&entry](const World& world) { return difference(world.name, answer_of(entry, world), {}); });
}

std::string single_triangles(const DetectorEntry& entry) {
    const Shape flat = triangle({0.0, 0.0, 0.001}, {0.03, 0.001, 0.0}, {0.002, 0.03, 0.0005});
    const Shape through = triangle({0.01, 0.01, -0.02}, {0.012, 0.011, 0.02}, {0.02, 0.03, 0.021});
    const Shape away = triangle({0.01, 0.01, 0.002}, {0.012, 0.011, 0.02}, {0.02, 0.03, 0.021});
    return over({make_world("two that cross", {{BodyKind::tissue, flat}, {BodyKind::instrument, through}}),
                 make_world("two apart", {{BodyKind::tissue, flat}, {BodyKind::instrument, away}}),
                 make_world("one through a sheet",
                            {{BodyKind::tissue, sheet(0.1, 4).shake(0.0005, 3)}, {BodyKind::instrument, through}})},
                [&entry](const World& world) { return compare(entry, world); });
}

std::string not_finite_is_reported(const DetectorEntry& entry) {
    std::string failures;
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()}) {
        const World good = sphere_in_sheet();
        const Pairs expected = answer_of(entry, good).pairs;
        World world = good;
        world.frame.position(1, 17) = bad;
        const auto refused = [&failures](std::string_view where, const ContactSet& contacts) {
            if (contacts.outcome.kind != OutcomeKind::not_finite || !contacts.pairs.empty()) {
                failures += fmt::format("{}: outcome {}, {} pairs\n", where, name_of(contacts.outcome.kind),
                                        contacts.pairs.size());
            }
        };
        const auto from_bad = make(entry);
        from_bad->prepare(world.topology, world.frame);
        refused("prepared with it", answer(*from_bad, world));
        failures += difference("after a bad start", answer(*from_bad, good), expected);
        const auto from_good = make(entry);
        from_good->prepare(good.topology, good.frame);
        failures += difference("before", answer(*from_good, good), expected);
        refused("in a tick", answer(*from_good, world));
        failures += difference("after", answer(*from_good, good), expected);
    }
    return failures;
}

std::string inputs_are_untouched(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) -> std::string {
        const World copy = world;
        (void)answer_of(entry, copy);
        const bool same = copy.frame.hash() == world.frame.hash() && copy.frame.previous == world.frame.previous &&
                          copy.topology.triangles == world.topology.triangles &&
                          copy.topology.body_pairs == world.topology.body_pairs;
        return same ? "" : world.name + ": an input changed\n";
    });
}

std::string same_answer_twice(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const ContactSet first = answer_of(entry, world);
        std::string failures = difference("a second instance on " + world.name, answer_of(entry, world), first.pairs);
        const auto detector = make(entry);
        const auto twin = make(entry);
        detector->prepare(world.topology, world.frame);
        twin->prepare(world.topology, world.frame);
        for (int k = 0; k < 3; ++k) {
            const ContactSet again = answer(*detector, world);
            failures += difference("again on " + world.name, again, first.pairs);
            // A method may do less where nothing moved, but always the same after the same frames.
            const std::int64_t work = again.work.work();
            if (work != answer(*twin, world).work.work() || work > first.work.work()) {
                failures += world.name + ": other work counters for the same frame\n";
            }
            if (again.native.size() != first.native.size()) failures += world.name + ": other native contacts\n";
        }
        return failures;
    });
}

std::string pairs_are_well_formed(const DetectorEntry& entry) {
    std::vector<World> worlds = general_scenes();
    worlds.push_back(integer_lattice());
    return over(worlds, [&entry](const World& world) {
        std::string failures;
        const Pairs pairs = answer_of(entry, world).pairs;
        for (std::size_t k = 0; k < pairs.size(); ++k) {
            const auto [a, b] = pairs[k];
            if (a < 0 || b <= a || b >= world.topology.triangle_count()) {
                return fmt::format("{}: pair ({}, {})\n", world.name, a, b);
            }
            if (k > 0 && !(pairs[k - 1] < pairs[k])) failures = world.name + ": not sorted, or a pair twice\n";
            const Index body_a = world.topology.body_of_triangle[static_cast<std::size_t>(a)];
            const Index body_b = world.topology.body_of_triangle[static_cast<std::size_t>(b)];
            if (world.topology.body_pair(body_a, body_b) < 0) {
                failures = fmt::format("{}: bodies {} and {} are not to be tested\n", world.name, body_a, body_b);
            }
        }
        return failures;
    });
}

std::string every_choice_answers_alike(const DetectorEntry& entry) {
    std::string failures;
    std::vector<World> worlds = long_triangle_scenes();
    worlds.push_back(shaft_in_slab());
    for (const World& world : worlds) {
        const Pairs expected = pairs_of_oracle(world);
        for (const Parameter& parameter : entry.parameters) {
            std::vector<std::string> values = parameter.choices;
            values.insert(values.end(), parameter.words.begin(), parameter.words.end());
            values.push_back(parameter.default_value);
            for (const std::string& value : values) {
                const Settings settings{{parameter.name, value}};
                failures += difference(fmt::format("{} {}={}", world.name, parameter.name, value),
                                       answer_of(entry, world, settings), expected);
            }
        }
    }
    for (const Parameter& parameter : entry.parameters) {
        if (parameter.meaning.empty()) failures += parameter.name + ": no meaning given\n";
    }
    return failures;
}

std::string native_contacts_are_plausible(const DetectorEntry& entry) {
    const World world = sphere_in_sheet();
    const ContactSet contacts = answer_of(entry, world, {}, true);
    if (!entry.native_contacts) return contacts.native.empty() ? "" : "undeclared native contacts\n";
    if (contacts.native.empty()) return "native contacts declared, none given\n";
    Box box;
    for (Index v = 0; v < world.topology.vertex_count; ++v) box.add(world.frame.position.col(v));
    std::string failures;
    for (const Contact& contact : contacts.native) {
        if (!contact.point.allFinite() || !contact.normal.allFinite() || !std::isfinite(contact.depth)) {
            failures = "a contact that is not finite\n";
        } else if (std::abs(contact.normal.norm() - 1.0) > 1e-4 || contact.depth < 0.0 || contact.depth > 0.2 ||
                   ((contact.point - box.min).array() < -1e-3).any() ||
                   ((box.max - contact.point).array() < -1e-3).any()) {
            failures = fmt::format("normal length {}, depth {}, point ({})\n", contact.normal.norm(), contact.depth,
                                   fmt::join(contact.point, ", "));
        }
    }
    return failures;
}

std::string native_normal_and_depth_of_a_tip(const DetectorEntry& entry) {
    // The tip of one triangle just below another: the short way out is up for the tip, down for the other.
    const Shape floor = triangle({-0.1, -0.1, 0.0}, {0.1, -0.1, 0.0}, {0.0, 0.15, 0.0});
    const Shape tip = triangle({0.0, 0.0, -0.01}, {0.03, 0.005, 0.1}, {-0.03, 0.002, 0.1});
    if (!entry.native_contacts) return "";
    std::string failures;
    for (const bool swapped : {false, true}) {
        const World world =
            make_world("tip", {{BodyKind::tissue, swapped ? tip : floor}, {BodyKind::tissue, swapped ? floor : tip}});
        const ContactSet contacts = answer_of(entry, world, {}, true);
        if (contacts.native.empty()) failures += "no contact\n";
        for (const Contact& contact : contacts.native) {
            const double up = swapped ? -contact.normal[2] : contact.normal[2];
            if (std::abs(up - 1.0) > 1e-3 || std::abs(contact.depth - 0.01) > 1e-5) {
                failures += fmt::format("swapped {}: normal ({}), depth {}\n", swapped, fmt::join(contact.normal, ", "),
                                        contact.depth);
            }
        }
    }
    return failures;
}

struct Check {
    const char* name;
    std::string (*run)(const DetectorEntry&);
};
constexpr Check checks[] = {
    {"SamePairsAsTheOracle", same_pairs_as_the_oracle},
    {"LongTrianglesAreFound", long_triangles},
    {"TouchingPairsAreFound", touching_pairs_are_found},
    {"ZeroAreaTrianglesAreFound", zero_area_triangles_are_found},
    {"SeventyBodiesGiveAllPairs", seventy_bodies},
    {"FarFromTheOriginNothingIsLost", far_from_the_origin},
    {"MicrometresMakeNoDifference", micrometre_scene},
    {"KilometresMakeNoDifference", kilometre_scene},
    {"OrderOfTrianglesAndVerticesMakesNoDifference", order_of_triangles_and_vertices},
    {"WindingMakesNoDifference", winding},
    {"ExactTranslationMakesNoDifference", exact_translation},
    {"SwappedBodiesGiveTheSamePairs", swapped_bodies},
    {"UpdateThenDetectEqualsFreshPrepare", update_equals_fresh_prepare},
    {"MovedRangesAreHonoured", moved_ranges_are_honoured},
    {"EmptyScenesHaveNoPairs", empty_scenes},
    {"SingleTrianglesAreFound", single_triangles},
    {"NotFiniteVertexIsReported", not_finite_is_reported},
    {"InputsAreUntouched", inputs_are_untouched},
    {"SameAnswerTwice", same_answer_twice},
    {"PairsAreWellFormed", pairs_are_well_formed},
    {"EveryChoiceAnswersAlike", every_choice_answers_alike},
    {"NativeContactsArePlausible", native_contacts_are_plausible},
    {"NativeNormalPointsFromAToBAndDepthIsTheTips", native_normal_and_depth_of_a_tip},
};

class DetectorContract : public testing::TestWithParam<std::tuple<std::size_t, std::size_t>> {};

TEST_P(DetectorContract, Holds) {
    const auto& [method, number] = GetParam();
    const DetectorEntry& entry = methods()[method];
    const Check& check = checks[number];
    const std::string failures = check.run(entry);
    const auto gaps = known_gaps("detectors");
    const auto gap = gaps.find({entry.name, check.name});
    if (gap == gaps.end()) {
        EXPECT_TRUE(failures.empty()) << failures;
    } else {
        EXPECT_FALSE(failures.empty()) << "the known gap is closed, remove the gap: " << gap->second;
        std::cout << "known gap: " << gap->second << "\n" << failures;
    }
}

std::string test_name(const testing::TestParamInfo<std::tuple<std::size_t, std::size_t>>& info) {
    return fmt::format("{}_{}", methods()[std::get<0>(info.param)].name, checks[std::get<1>(info.param)].name);
}

INSTANTIATE_TEST_SUITE_P(Every, DetectorContract,
                         testing::Combine(testing::Range(std::size_t{0}, methods().size()),
                                          testing::Range(std::size_t{0}, std::size(checks))),
                         test_name);

TEST(KnownGaps, NameOnlyChecksThatExist) {
    for (const auto& [key, reason] : known_gaps("detectors")) {
        EXPECT_TRUE(std::any_of(std::begin(checks), std::end(checks), [&key = key](const Check& c) {
            return key.second == c.name;
        })) << key.second;
        EXPECT_FALSE(reason.empty()) << key.first << " " << key.second;
    }
}

}  // namespace
}  // namespace trocar::test
