// What every registered detector owes its caller, own or foreign: each check runs for each method and is a test of its
// own. A detector that answers within a query distance owes exactly the pairs of triangles at most that far apart,
// those that meet in one list and the near ones in the other; it is asked within none and within some. What a library
// is known to get wrong is listed in known_gaps.json with the reason; it must go on failing, or the list is out of
// date.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "contract/contract_support.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar::test {
namespace {

// ---- what is expected ----

struct Expected {
    double query_distance = 0.0;
    Pairs meeting = {};
    Pairs near = {};                     ///< certainly within the query distance; they do not meet
    std::set<TrianglePair> either = {};  ///< within 1e-9 of it, relatively: rounding decides
};

/// The near pairs by a double loop.
Expected expected_within(const World& world, double query_distance, const Pairs& meeting) {
    Expected expected{.query_distance = query_distance, .meeting = meeting};
    if (query_distance == 0.0) return expected;
    constexpr double slack = 1e-9;
    for (const auto& [first, second] : world.topology.body_pairs) {
        const Range a_range = world.topology.bodies[at(first)].triangles;
        const Range b_range = world.topology.bodies[at(second)].triangles;
        std::vector<Corners> others;
        std::vector<Box> boxes;
        for (Index b = b_range.first; b < b_range.end(); ++b) {
            others.push_back(corners_of(world, b));
            boxes.push_back(box_of(world, b));
        }
        for (Index a = a_range.first; a < a_range.end(); ++a) {
            const Corners one = corners_of(world, a);
            Box around = box_of(world, a);
            around.min.array() -= 2.0 * query_distance;
            around.max.array() += 2.0 * query_distance;
            for (Index b = b_range.first; b < b_range.end(); ++b) {
                const std::size_t k = at(b - b_range.first);
                if (!around.overlaps(boxes[k])) continue;
                const double distance = std::sqrt(triangle_distance(one, others[k]).squared_distance);
                if (triangles_intersect(one, others[k])) continue;
                if (std::abs(distance - query_distance) <= slack * query_distance) {
                    expected.either.insert({a, b});
                } else if (distance < query_distance) {
                    expected.near.push_back({a, b});
                }
            }
        }
    }
    std::sort(expected.near.begin(), expected.near.end());
    return expected;
}

Pairs without(const Pairs& all, const Pairs& some) {
    Pairs rest;
    std::set_difference(all.begin(), all.end(), some.begin(), some.end(), std::back_inserter(rest));
    return rest;
}

/// Empty when the answer is what is expected, else how it differs. A near pair that the detector takes for meeting is a
/// matter of the meeting ones.
std::string difference(std::string_view where, const ContactSet& contacts, const Expected& expected) {
    const std::string here = fmt::format("{}, query distance {:g}", where, expected.query_distance);
    if (!contacts.outcome.ok()) {
        return fmt::format("{}: outcome {} ({})\n", here, name_of(contacts.outcome.kind), contacts.outcome.message);
    }
    std::string failures;
    if (contacts.truncated) failures += here + ": truncated\n";
    if (contacts.query_distance != expected.query_distance)
        failures += fmt::format("{}: answered within {:g}\n", here, contacts.query_distance);
    if (contacts.pairs != expected.meeting) {
        failures += fmt::format("{}: {} of {} pairs missing, {} extra, {} reported\n", here,
                                without(expected.meeting, contacts.pairs).size(), expected.meeting.size(),
                                without(contacts.pairs, expected.meeting).size(), contacts.pairs.size());
    }
    if (!std::is_sorted(contacts.near.begin(), contacts.near.end()) ||
        std::adjacent_find(contacts.near.begin(), contacts.near.end()) != contacts.near.end()) {
        return failures + here + ": near pairs out of order, or one twice\n";
    }
    const Pairs missing = without(without(expected.near, contacts.near), contacts.pairs);
    Pairs extra = without(contacts.near, expected.near);
    std::erase_if(extra, [&](const TrianglePair& pair) { return expected.either.contains(pair); });
    if (without(contacts.near, contacts.pairs).size() != contacts.near.size())
        failures += here + ": pairs in both lists\n";
    if (!missing.empty() || !extra.empty()) {
        failures += fmt::format("{}: {} of {} near pairs missing, {} extra, {} reported\n", here, missing.size(),
                                expected.near.size(), extra.size(), contacts.near.size());
    }
    return failures;
}

double mean_edge(const World& world) {
    double sum = 0.0;
    for (Index t = 0; t < world.topology.triangle_count(); ++t) {
        const Corners c = corners_of(world, t);
        for (std::size_t k = 0; k < 3; ++k) sum += (c[(k + 1) % 3] - c[k]).norm();
    }
    return sum / (3.0 * std::max<Index>(1, world.topology.triangle_count()));
}

/// m: 0 and, where the detector answers within a query distance, 0.1 and 1 mean edge; ten where there are few
/// triangles.
std::vector<double> query_distances(const DetectorEntry& entry, const World& world) {
    if (!entry.query_distance) return {0.0};
    const double edge = mean_edge(world);
    std::vector<double> list{0.0, 0.1 * edge, edge};
    if (world.topology.triangle_count() < 200) list.push_back(10.0 * edge);
    return list;
}
/// m: 0 and, likewise, this part of the mean edge.
std::vector<double> query_distances(const DetectorEntry& entry, const World& world, double part) {
    if (!entry.query_distance) return {0.0};
    return {0.0, part * mean_edge(world)};
}

/// Against the rational oracle.
std::string compare(const DetectorEntry& entry, const World& world) {
    std::string failures;
    const Pairs meeting = pairs_of_oracle(world);
    for (const double query_distance : query_distances(entry, world)) {
        failures += difference(world.name, answer_of(entry, world, {}, false, query_distance),
                               expected_within(world, query_distance, meeting));
    }
    return failures;
}
std::string compare_all(const DetectorEntry& entry, const std::vector<World>& worlds) {
    return over(worlds, [&entry](const World& world) { return compare(entry, world); });
}

/// What an answer within some distances must equal: what the detector says of `world`, and the near pairs there.
std::string compare_with_own(const DetectorEntry& entry, const World& world,
                             const std::function<ContactSet(double)>& answer_within) {
    std::string failures;
    const Pairs meeting = answer_of(entry, world).pairs;
    for (const double query_distance : query_distances(entry, world, 0.3)) {
        failures +=
            difference(world.name, answer_within(query_distance), expected_within(world, query_distance, meeting));
    }
    return failures;
}

// ---- checks: empty text = kept ----

std::string same_pairs_as_the_oracle(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        if (pairs_of_oracle(world).size() < 10) return world.name + ": too few pairs for a test\n";
        return compare(entry, world);
    });
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

std::string bodies_apart(const DetectorEntry& entry) {
    return over(apart_scenes(), [&entry](const World& world) {
        const double most = query_distances(entry, world).back();
        if (most > 0.0 && expected_within(world, most, {}).near.empty()) return world.name + ": nothing is tested\n";
        return compare(entry, world);
    });
}
std::string long_triangles(const DetectorEntry& entry) { return compare_all(entry, long_triangle_scenes()); }
std::string touching_pairs_are_found(const DetectorEntry& entry) {
    return over(touching_scenes(), [&entry](const World& world) {
        if (pairs_of_oracle(world).empty()) return world.name + ": too few pairs for a test\n";
        return compare(entry, world);
    });
}
std::string zero_area_triangles_are_found(const DetectorEntry& entry) { return compare_all(entry, zero_area_scenes()); }
std::string seventy_bodies(const DetectorEntry& entry) { return compare(entry, many_bodies()); }

std::string far_from_the_origin(const DetectorEntry& entry) {
    // Rounding at 10 km moves vertices: the oracle sees the moved ones too.
    return compare_all(entry, {moved(sphere_in_sheet(), {1e4, -2e4, 1.5e4}), moved(shaft_in_slab(), {-1e4, 0.0, 3e4})});
}
std::string micrometre_scene(const DetectorEntry& entry) {
    return compare_all(entry, {scaled(sphere_in_sheet(), 1e-5), scaled(shaft_in_slab(), 1e-5)});
}
std::string kilometre_scene(const DetectorEntry& entry) {
    return compare_all(entry, {scaled(sphere_in_sheet(), 1e5), scaled(shaft_in_slab(), 1e5)});
}

std::string order_of_triangles_and_vertices(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const Permutation other = shuffled(world.topology, 1, Shuffle::triangles_and_vertices);
        return compare_with_own(
            entry, world, [&](double query_distance) { return permuted_answer(entry, world, other, query_distance); });
    });
}

std::string winding(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        World other = world;
        for (Index t = 0; t < world.topology.triangle_count(); t += 2) {
            std::swap(other.topology.triangles(1, t), other.topology.triangles(2, t));
        }
        return compare_with_own(
            entry, world, [&](double query_distance) { return answer_of(entry, other, {}, false, query_distance); });
    });
}

std::string exact_translation(const DetectorEntry& entry) {
    return over(general_scenes(), [&entry](const World& world) {
        const World here{world.name, world.topology, on_grid(world.frame)};
        const World there = moved(here, {16.0, -8.0, 4.0});
        return compare_with_own(
            entry, here, [&](double query_distance) { return answer_of(entry, there, {}, false, query_distance); });
    });
}

std::string swapped_bodies(const DetectorEntry& entry) {
    const World world = shaft_in_slab();
    const Permutation swapped = with_bodies_in_order(world.topology, {1, 0});
    return compare_with_own(
        entry, world, [&](double query_distance) { return permuted_answer(entry, world, swapped, query_distance); });
}

/// Body 0 travels and turns, the others ripple or rest, and once everything jumps; the query distance grows, shrinks,
/// is 0 in between; ranges are reported every other time.
std::string update_equals_fresh_prepare(const DetectorEntry& entry) {
    std::vector<World> worlds = general_scenes();
    for (const World& world : apart_scenes()) worlds.push_back(world);
    return over(worlds, [&entry](World world) {
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        const double edge = entry.query_distance ? mean_edge(world) : 0.0;
        const double factors[] = {0.1, 0.1, 0.0, 0.2, 0.8, 0.8, 0.1, 0.1, 0.0, 0.0, 0.4, 0.05, 0.1, 0.1};
        const BodyRange& body = world.topology.bodies[0];
        const Matrix3 turn = Eigen::AngleAxisd(0.04, Vector3(1, 1, 0).normalized()).toRotationMatrix();
        std::string failures;
        int tick = 0;
        for (const double factor : factors) {
            world.frame.previous = world.frame.position;
            const bool jumps = tick == 6;
            const bool all_move = jumps || tick % 4 < 2;
            const bool rests = tick % 5 == 4;
            for (Index v = 0; v < world.topology.vertex_count && !rests; ++v) {
                Vector3 x = world.frame.position.col(v);
                if (body.vertices.contains(v)) {
                    x = turn * x + Vector3(0.0008, -0.0005, -0.0008);
                } else if (all_move) {
                    x += 0.0003 * Vector3(std::sin(90 * x[1]), std::sin(80 * x[2]), std::sin(70 * x[0] + tick));
                }
                if (jumps) x += Vector3(0.3, -0.1, 0.2);
                world.frame.position.col(v) = x;
            }
            if (jumps) world.frame.previous = world.frame.position;  // put there: no way to be followed
            world.frame.moved.reset();
            if (tick % 2 == 1) {
                world.frame.moved.emplace();
                if (!rests) world.frame.moved->push_back(body.vertices);
                if (!rests && all_move) {
                    world.frame.moved->push_back(
                        {body.vertices.end(), world.topology.vertex_count - body.vertices.end()});
                }
            }
            ++world.frame.tick;
            world.frame.time += 0.001;
            World fresh = world;
            fresh.frame.moved.reset();
            failures +=
                difference(fmt::format("{}, tick {}", world.name, tick), answer(*detector, world, false, factor * edge),
                           expected_within(fresh, factor * edge, answer_of(entry, fresh).pairs));
            ++tick;
        }
        return failures;
    });
}

std::string moved_ranges_are_honoured(const DetectorEntry& entry) {
    // Frames that say what moved: first nothing, then part of one body, then the other body.
    World world = shaft_in_slab();
    const auto detector = make(entry);
    detector->prepare(world.topology, world.frame);
    std::string failures = difference("first", answer(*detector, world), {.meeting = answer_of(entry, world).pairs});
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
        failures += difference(fmt::format("tick {}", tick), answer(*detector, world),
                               {.meeting = answer_of(entry, plain).pairs});
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
    return over(worlds,
                [&entry](const World& world) { return difference(world.name, answer_of(entry, world), Expected()); });
}

std::string single_triangles(const DetectorEntry& entry) {
    const Shape flat = triangle({0.0, 0.0, 0.001}, {0.03, 0.001, 0.0}, {0.002, 0.03, 0.0005});
    const Shape through = triangle({0.01, 0.01, -0.02}, {0.012, 0.011, 0.02}, {0.02, 0.03, 0.021});
    const Shape away = triangle({0.01, 0.01, 0.002}, {0.012, 0.011, 0.02}, {0.02, 0.03, 0.021});
    return compare_all(
        entry, {make_world("two that cross", {{BodyKind::tissue, flat}, {BodyKind::instrument, through}}),
                make_world("two apart", {{BodyKind::tissue, flat}, {BodyKind::instrument, away}}),
                make_world("one through a sheet",
                           {{BodyKind::tissue, sheet(0.1, 4).shake(0.0005, 3)}, {BodyKind::instrument, through}})});
}

std::string not_finite_is_reported(const DetectorEntry& entry) {
    std::string failures;
    const World good = sphere_in_sheet();
    const Pairs meeting = answer_of(entry, good).pairs;
    for (const double query_distance : query_distances(entry, good, 0.2)) {
        const Expected expected = expected_within(good, query_distance, meeting);
        for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                                 -std::numeric_limits<double>::infinity()}) {
            World world = good;
            world.frame.position(1, 17) = bad;
            const auto is_as_expected = [&](std::string_view where, Detector& detector) {
                failures += difference(where, answer(detector, good, false, query_distance), expected);
            };
            const auto refuses = [&](std::string_view where, Detector& detector) {
                const ContactSet contacts = answer(detector, world, false, query_distance);
                if (contacts.outcome.kind != OutcomeKind::not_finite || !contacts.pairs.empty() ||
                    !contacts.near.empty()) {
                    failures +=
                        fmt::format("{}: outcome {}, {} pairs, {} near\n", where, name_of(contacts.outcome.kind),
                                    contacts.pairs.size(), contacts.near.size());
                }
            };
            const auto from_bad = make(entry);
            from_bad->prepare(world.topology, world.frame);
            refuses("prepared with it", *from_bad);
            is_as_expected("after a bad start", *from_bad);
            const auto from_good = make(entry);
            from_good->prepare(good.topology, good.frame);
            is_as_expected("before", *from_good);
            refuses("in a tick", *from_good);
            is_as_expected("after", *from_good);
        }
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
        std::string failures;
        std::int64_t least_work = -1;
        for (const double query_distance : query_distances(entry, world, 0.2)) {
            const ContactSet first = answer_of(entry, world, {}, false, query_distance);
            const auto detector = make(entry);
            const auto twin = make(entry);
            detector->prepare(world.topology, world.frame);
            twin->prepare(world.topology, world.frame);
            for (int k = 0; k < 3; ++k) {
                const ContactSet again = answer(*detector, world, false, query_distance);
                if (again.pairs != first.pairs || again.near != first.near) failures += world.name + ": other pairs\n";
                // A method may do less where nothing moved, but always the same after the same frames.
                const std::int64_t work = again.work.work();
                if (work != answer(*twin, world, false, query_distance).work.work() || work > first.work.work()) {
                    failures += world.name + ": other work counters for the same frame\n";
                }
                if (again.native.size() != first.native.size()) failures += world.name + ": other native contacts\n";
            }
            if (entry.own && first.work.work() <= least_work) {
                failures += world.name + ": the tests within the query distance are not counted\n";
            }
            least_work = first.work.work();
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
        const Pairs meeting = pairs_of_oracle(world);
        for (const double query_distance : query_distances(entry, world, 0.3)) {
            const Expected expected = expected_within(world, query_distance, meeting);
            for (const Parameter& parameter : entry.parameters) {
                std::vector<std::string> values = parameter.choices;
                values.insert(values.end(), parameter.words.begin(), parameter.words.end());
                values.push_back(parameter.default_value);
                for (const std::string& value : values) {
                    const ContactSet contacts =
                        answer_of(entry, world, {{parameter.name, value}}, false, query_distance);
                    // A library's choice may be one that has no query distance; then it says so.
                    const bool refused = contacts.outcome.kind == OutcomeKind::unsupported && query_distance > 0.0;
                    if (refused && !contacts.outcome.message.empty() && contacts.near.empty() && !entry.own &&
                        value != parameter.default_value) {
                        continue;
                    }
                    failures +=
                        difference(fmt::format("{} {}={}", world.name, parameter.name, value), contacts, expected);
                }
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

/// Nothing moves, which the frames report or do not.
std::string query_distance_that_grows_over_bodies_at_rest(const DetectorEntry& entry) {
    std::vector<World> worlds = apart_scenes();
    worlds.push_back(shaft_in_slab());
    return over(worlds, [&entry](const World& world) {
        std::string failures;
        const Pairs meeting = answer_of(entry, world).pairs;
        const double most = query_distances(entry, world).back();
        for (const bool reported : {false, true}) {
            World resting = world;
            if (reported) resting.frame.moved.emplace();
            const auto detector = make(entry);
            detector->prepare(world.topology, world.frame);
            for (const double query_distance : {0.0, 0.0, 0.0, most, most, 0.1 * most, 0.0, 0.0, 0.2 * most}) {
                failures += difference(world.name, answer(*detector, resting, false, query_distance),
                                       expected_within(world, query_distance, meeting));
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
                                   expected_within(world, query_distance, answer_of(entry, world).pairs));
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
        const Expected expected = expected_within(world, query_distance, answer_of(entry, world).pairs);
        if (expected.near.size() < 10) failures += "too few near pairs for a test\n";
        const auto detector = make(entry);
        detector->prepare(world.topology, world.frame);
        failures += difference(fmt::format("jump {}", jump), answer(*detector, world, false, query_distance), expected);
    }
    return failures;
}

bool holds_all(const Pairs& all, const Pairs& some) {
    return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

/// Near pairs count, what is reported is true, and what is cut off is reported.
std::string limits(const DetectorEntry& entry) {
    const World world = shaft_in_slab();
    std::string failures;
    for (const Parameter& parameter : entry.parameters) {
        if (parameter.name != "work_budget") continue;
        for (const double query_distance : query_distances(entry, world, 0.3)) {
            const ContactSet all = answer_of(entry, world, {{"work_budget", "1e12"}}, false, query_distance);
            const auto count = static_cast<std::int64_t>(all.pairs.size() + all.near.size());
            constexpr int parts = 40;
            for (int part = 0; part <= 2 * parts; ++part) {
                const std::int64_t limit = all.work.work() * part / parts;
                const auto detector = make(entry, {{parameter.name, std::to_string(limit)}});
                detector->prepare(world.topology, world.frame);
                for (int tick = 0; tick < 2; ++tick) {
                    const ContactSet some = answer(*detector, world, false, query_distance);
                    const auto reported = static_cast<std::int64_t>(some.pairs.size() + some.near.size());
                    const bool whole = reported == count && !some.truncated;
                    if (!holds_all(all.pairs, some.pairs) || !holds_all(all.near, some.near) ||
                        (reported < count && !some.truncated) || (part == 2 * parts && !whole) ||
                        some.work.work() > limit) {
                        failures +=
                            fmt::format("{}={}, tick {}: {} of {} pairs, truncated {}, work {}\n", parameter.name,
                                        limit, tick, reported, count, some.truncated, some.work.work());
                    }
                }
            }
        }
    }
    return failures;
}

/// One that has no query distance refuses, and answers as before without it.
std::string refuses_a_query_distance(const DetectorEntry& entry) {
    const World world = sphere_in_sheet();
    const auto detector = make(entry);
    detector->prepare(world.topology, world.frame);
    const ContactSet refused = answer(*detector, world, false, 0.001);
    std::string failures;
    if (refused.outcome.kind != OutcomeKind::unsupported || refused.outcome.message.empty() || !refused.pairs.empty() ||
        !refused.near.empty()) {
        failures += fmt::format("outcome {}\n", name_of(refused.outcome.kind));
    }
    return failures + difference("again", answer(*detector, world), {.meeting = answer_of(entry, world).pairs});
}

enum class Asks : std::uint8_t { every, those_within_query_distance, others };

struct Check {
    const char* name;
    std::string (*run)(const DetectorEntry&);
    Asks asks = Asks::every;
};
constexpr Check checks[] = {
    {"SamePairsAsTheOracle", same_pairs_as_the_oracle},
    {"BodiesApartHaveTheirNearPairs", bodies_apart},
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
    {"AQueryDistanceThatGrowsOverBodiesAtRestIsFollowed", query_distance_that_grows_over_bodies_at_rest,
     Asks::those_within_query_distance},
    {"ABodyThatMovesInPartIsFollowedWithinQueryDistance", body_that_moves_in_part, Asks::those_within_query_distance},
    {"BodiesThatComeFromAfarHaveTheirNearPairs", bodies_that_come_from_afar, Asks::those_within_query_distance},
    {"LimitsCoverNearPairs", limits, Asks::those_within_query_distance},
    {"RefusesAQueryDistanceThatItDoesNotHave", refuses_a_query_distance, Asks::others},
};

/// A method and a check, as numbers, so that names of tests are alike in every build.
using Question = std::pair<std::size_t, std::size_t>;
std::vector<Question> questions() {
    std::vector<Question> list;
    for (std::size_t method = 0; method < methods().size(); ++method) {
        const Asks asked = methods()[method].query_distance ? Asks::those_within_query_distance : Asks::others;
        for (std::size_t check = 0; check < std::size(checks); ++check) {
            if (checks[check].asks == Asks::every || checks[check].asks == asked) list.emplace_back(method, check);
        }
    }
    return list;
}

class DetectorContract : public testing::TestWithParam<Question> {};

TEST_P(DetectorContract, Holds) {
    const DetectorEntry& entry = methods()[GetParam().first];
    const Check& check = checks[GetParam().second];
    expect_kept("detectors", {entry.name}, check.name, check.run(entry));
}

INSTANTIATE_TEST_SUITE_P(Every, DetectorContract, testing::ValuesIn(questions()), [](const auto& question) {
    return fmt::format("{}_{}", methods()[question.param.first].name, checks[question.param.second].name);
});

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
