// The contact generators `proximity` and `tracked_proximity` against a second implementation that shares nothing with
// them (second_features.hpp), as sets, on scenes that move: which features are reported, gap, normal and side.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <set>

#include "contact_generation/pair_contacts.hpp"
#include "contact_generation/second_features.hpp"
#include "method/registry.hpp"
#include "simulate/simulation.hpp"
#include "support/scene_samples.hpp"
#include "support/shapes.hpp"

namespace trocar::test {
namespace {

struct Case {
    const char* name;
    const char* scene;
    double faster;
    int ticks;
    int every;             ///< compare on every such tick
    const char* response;  ///< that drives the run
};

Scene scene_of(const Case& one) {
    if (std::string(one.scene) == "jump") {
        // Above the sheet, and 20 mm lower within one tick.
        std::string text = poke_text();
        const std::string keys = "{\"time\":0.04,";
        text.replace(text.find(keys), keys.size(),
                     "{\"time\":0.0205,\"pose\":[0.001,0.0007,0.0105,0,0,0]},"
                     "{\"time\":0.021,\"pose\":[0.001,0.0007,-0.0095,0,0,0]},"
                     "{\"time\":0.04,");
        return scene_from_text(text);
    }
    Scene scene = test::shipped_scene(one.scene);
    speed_up(scene, one.faster);
    return scene;
}

/// Of two vertices on an edge each, or of a vertex and a triangle.
using Feature = std::array<Index, 4>;
Feature edges(const EdgeEnds& a, const EdgeEnds& b) { return {a[0], a[1], b[0], b[1]}; }
Feature point_face(Index vertex, Index triangle) { return {vertex, triangle, -1, -1}; }

/// Ids as docs/CONTACT.md defines them: the kind in the highest bit, features below.
bool is_edges(const Contact& contact) { return contact.kind == ContactCase::edge_edge; }
Feature feature_of(const Contact& contact) {
    if (is_edges(contact)) {
        return {contact.on_a.vertices[0], contact.on_a.vertices[1], contact.on_b.vertices[0], contact.on_b.vertices[1]};
    }
    return point_face(static_cast<Index>(contact.id >> 32), static_cast<Index>(contact.id & 0xffffffffU));
}

struct Expected {
    Real gap = 0.0L;
    Point normal = Point::Zero();  ///< from a to b; of points, from the face to the vertex
    bool vertex_first = true;
    bool has_normal = true;
};

struct Tally {
    std::size_t compared = 0;
    std::size_t open = 0;     ///< too near a threshold
    int truncated = 0;        ///< ticks
    std::size_t crossed = 0;  ///< of those compared
    std::size_t edges = 0;
    std::string failures;
    void fail(const std::string& text) {
        if (failures.size() < 2000) failures += text + "\n";
    }
};

/// Gap and normal of a contact that both report.
void compare(std::int64_t tick, const Contact& reported, const Expected& expected, Real extent, Tally& tally) {
    ++tally.compared;
    if (reported.gap < 0.0) ++tally.crossed;
    if (is_edges(reported)) ++tally.edges;
    const auto who = [&] {
        const Feature f = feature_of(reported);
        return fmt::format("tick {}, {} {} {} {} {}", tick, is_edges(reported) ? "edges" : "vertex and face", f[0],
                           f[1], f[2], f[3]);
    };
    const Real off = std::abs(static_cast<Real>(reported.gap) - expected.gap);
    // Closest points of nearly parallel edges are uncertain along the edges, their distance is not.
    if (off > 1e-12L * extent)
        tally.fail(
            fmt::format("{}: gap {:.15g}, expected {:.15g}", who(), reported.gap, static_cast<double>(expected.gap)));
    if (std::abs(expected.gap) > undecided * extent && reported.side != (expected.gap < 0.0L ? -1 : 1))
        tally.fail(fmt::format("{}: the other side, gap {:g}", who(), reported.gap));
    const Real gap = std::abs(expected.gap);
    if (!expected.has_normal || gap < 1e-8L) return;
    Point normal = expected.normal;
    if (!is_edges(reported) && expected.vertex_first) normal = -normal;
    const Real turned = (reported.normal.cast<Real>() - normal).norm();
    if (turned > 1e-12L * extent / gap + 1e-15L)
        tally.fail(fmt::format("{}: normal off by {:g} at gap {:g}", who(), static_cast<double>(turned),
                               static_cast<double>(expected.gap)));
}

Real extent_of(const Frame& frame) {
    return static_cast<Real>((frame.position.rowwise().maxCoeff() - frame.position.rowwise().minCoeff()).norm());
}

/// Whether the detector has reported two triangles that have these features.
bool is_brought(const Topology& topology, const Simulation& run, const Feature& feature) {
    const auto has = [&topology](Index triangle, Index vertex) {
        return (topology.triangles.col(triangle).array() == vertex).any();
    };
    const auto matches = [&](Index a, Index b) {
        if (feature[2] < 0) return has(a, feature[0]) && b == feature[1];
        return has(a, feature[0]) && has(a, feature[1]) && has(b, feature[2]) && has(b, feature[3]);
    };
    for (const auto list : {&ContactSet::pairs, &ContactSet::near}) {
        for (const TrianglePair& pair : run.contacts().*list) {
            if (matches(pair.a, pair.b) || matches(pair.b, pair.a)) return true;
        }
    }
    return false;
}

/// `either`: may be reported and need not.
void compare_sets(const Topology& topology, const Simulation& run, const std::map<Feature, Expected>& expected,
                  const std::set<Feature>& either, const std::set<Feature>& beside, Tally& tally) {
    const Real extent = extent_of(run.seen());
    std::map<Feature, const Contact*> reported;
    for (const Contact& contact : run.contacts().contacts) {
        if (reported.emplace(feature_of(contact), &contact).second) continue;
        // Layers of one surface over one vertex share an anchor.
        if (contact.gap >= 0.0) tally.fail(fmt::format("tick {}: one feature twice", run.seen().tick));
    }
    for (const auto& [feature, contact] : reported) {
        const auto found = expected.find(feature);
        if (either.contains(feature)) {
            ++tally.open;
        } else if (found != expected.end()) {
            compare(run.seen().tick, *contact, found->second, extent, tally);
        } else if (!beside.contains(feature)) {
            tally.fail(fmt::format("tick {}: {} {} {} {} {} reported, gap {:g}", run.seen().tick,
                                   is_edges(*contact) ? "edges" : "vertex and face", feature[0], feature[1], feature[2],
                                   feature[3], contact->gap));
        }
    }
    for (const auto& [feature, one] : expected) {
        if (reported.contains(feature) || either.contains(feature)) continue;
        // No detector brings a pair that a script moves beyond the query distance within the tick. What has crossed is
        // reported all the same.
        if (one.gap > 0.0L && !is_brought(topology, run, feature)) continue;
        tally.fail(fmt::format("tick {}: {} {} {} {} not reported, gap {:g}, normal {:g} {:g} {:g}", run.seen().tick,
                               feature[0], feature[1], feature[2], feature[3], static_cast<double>(one.gap),
                               static_cast<double>(one.normal[0]), static_cast<double>(one.normal[1]),
                               static_cast<double>(one.normal[2])));
    }
}

Expected expected_of(const SecondPointFace& one, Real gap) {
    Expected expected{.gap = gap, .vertex_first = one.vertex_body < one.face_body};
    if (one.distance > 0.0L) expected.normal = (gap < 0.0L ? -1.0L : 1.0L) * one.path / one.distance;
    return expected;
}

// ------------------------------------------------------------------ near

void check_near(const Simulation& run, const SecondFeatures& second, Tally& tally) {
    const auto query_distance = static_cast<Real>(run.contacts().query_distance);
    std::map<Feature, Expected> expected;
    std::set<Feature> either;
    std::map<std::pair<Index, Index>, std::vector<SecondPointFace>> of_vertex;
    for (const SecondPointFace& one : second.point_faces(query_distance)) {
        if (one.open) either.insert(point_face(one.vertex, one.triangle));
        if (one.closest || one.open) of_vertex[{one.vertex, one.face_body}].push_back(one);
    }
    for (auto& [who, list] : of_vertex) {
        std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.distance < b.distance; });
        const Real home =
            !second.body(who.second).closed && second.body(who.second).start_side == SheetSide::back ? -1 : 1;
        const SecondPointFace& nearest = list.front();
        // Which is nearest, and whether it is behind, must not hang on rounding.
        const bool undecidable = nearest.open ||
                                 (list.size() > 1 && list[1].distance - nearest.distance < 1e-9L * query_distance) ||
                                 std::abs(nearest.front) < 1e-9L * query_distance;
        const bool inside = home * nearest.front < 0.0L;
        for (const SecondPointFace& one : list) {
            const Feature feature = point_face(one.vertex, one.triangle);
            if (undecidable || std::abs(one.front) < 1e-9L * query_distance) {
                either.insert(feature);
            } else if (inside && &one == &nearest) {
                expected[feature] = expected_of(one, -one.distance);
            } else if (!inside && home * one.front > 0.0L) {
                expected[feature] = expected_of(one, one.distance);
            }
        }
    }
    for (const SecondEdgeEdge& one : second.edge_edges(query_distance)) {
        if (one.open) either.insert(edges(one.a, one.b));
        if (one.may_be_apart) expected[edges(one.a, one.b)] = {.gap = one.distance, .normal = one.normal};
    }
    compare_sets(second.topology(), run, expected, either, {}, tally);
}

// ------------------------------------------------------------------ tracked

void check_tracked_proximity(const Simulation& run, const SecondFeatures& second, SecondSides& sides, Tally& tally) {
    const auto query_distance = static_cast<Real>(run.contacts().query_distance);
    std::map<Feature, Expected> expected;
    std::set<Feature> either;
    std::set<Feature>
        beside;  // faces next to the one over which a vertex is: `tracked_proximity` holds a ridge by both
    // What has crossed is reported at the nearest point, within the query distance or not.
    std::map<std::pair<Index, Index>, SecondPointFace> crossed;
    for (const auto& [vertices, b] : second.questions()) {
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            const int count = sides.count(v, b);
            if (count == 0) continue;
            const SecondPointFace nearest = second.nearest(second.points()[static_cast<std::size_t>(v)], b);
            const Real depth = -(count > 0 ? 1.0L : -1.0L) * nearest.front;
            if (!second.body(b).closed && nearest.at_rim && depth < 0.5L * nearest.distance) {
                sides.forget(v, b);
                either.insert(point_face(v, nearest.triangle));
                continue;
            }
            crossed[{v, b}] = nearest;
            SecondPointFace one = nearest;
            one.vertex = v;
            one.vertex_body = second.body_of(v);
            one.face_body = b;
            const Feature feature = point_face(v, one.triangle);
            Expected reported = expected_of(one, -one.distance);
            reported.has_normal = depth > 1e-9L;
            if (one.open) {
                either.insert(feature);
            } else {
                expected[feature] = reported;
            }
        }
    }
    for (const SecondPointFace& one : second.point_faces(query_distance)) {
        const Feature feature = point_face(one.vertex, one.triangle);
        if (one.open) either.insert(feature);
        const auto behind = crossed.find({one.vertex, one.face_body});
        if (behind != crossed.end() && behind->second.triangle != one.triangle &&
            std::abs(behind->second.distance - one.distance) < 1e-9L * query_distance) {
            // Its nearest point is on an edge: which of the two faces has it hangs on rounding.
            either.insert(feature);
            either.insert(point_face(one.vertex, behind->second.triangle));
        }
        if (!one.closest) {
            beside.insert(feature);
            continue;
        }
        if (expected.contains(feature)) continue;
        const int count = sides.count(one.vertex, one.face_body);
        if (std::abs(one.front) < 1e-9L * query_distance) {
            either.insert(feature);
        } else if (second.body(one.face_body).closed && one.front < 0.0L) {
            continue;  // seen through the body
        } else if (count == 0 || count * one.front > 0.0L) {
            expected[feature] = expected_of(one, one.distance);
        }
    }
    for (const SecondEdgeEdge& one : second.edge_edges(query_distance)) {
        const Feature feature = edges(one.a, one.b);
        if (one.open) either.insert(feature);
        bool passed = false;
        if (one.may_have_crossed) {
            const bool of_b = second.body(one.body_a).closed || !second.body(one.body_b).closed;
            const Index through = of_b ? one.body_a : one.body_b;
            if (second.body(through).closed && sides.is_on(of_b ? one.point_b : one.point_a, through)) {
                either.insert(feature);
            }
            passed = of_b ? sides.count_on_edge(one.b[0], one.point_b, one.body_a) != 0
                          : sides.count_on_edge(one.a[0], one.point_a, one.body_b) != 0;
        }
        if (passed) {
            expected[feature] = {.gap = -one.distance, .normal = -one.normal};
        } else if (one.may_be_apart) {
            expected[feature] = {.gap = one.distance, .normal = one.normal};
        }
    }
    compare_sets(second.topology(), run, expected, either, beside, tally);
}

// ------------------------------------------------------------------ on scenes that move

void PrintTo(const Case& one, std::ostream* stream) { *stream << one.name; }

class ContactGenerators : public testing::TestWithParam<Case> {};

Tally tally_of(const Case& one, const std::string& generator) {
    const Scene scene = scene_of(one);
    // Pairs are another test's claim (DetectorContract); here they need not be slow.
    Simulation run(scene, make_detector("ohc"), make_response(one.response), registry().contact_generator(generator));
    SecondFeatures second(scene.topology);
    SecondSides sides(second, scene.topology);
    Tally tally;
    for (int tick = 0; tick < one.ticks && run.outcome().ok(); ++tick) {
        const StepRow row = run.step();
        second.place(run.seen());
        if (generator == "tracked_proximity") {
            if (tick == 0) sides.start();
            sides.follow();
        }
        if (tick % one.every != 0) continue;
        if (row.truncated) {  // reported: what is deeper than the query distance may be missing
            ++tally.truncated;
            continue;
        }
        if (generator == "tracked_proximity") {
            check_tracked_proximity(run, second, sides, tally);
        } else {
            check_near(run, second, tally);
        }
        if (tally.failures.size() > 2000) break;
    }
    EXPECT_TRUE(run.outcome().ok()) << run.outcome().message;
    EXPECT_LT(tally.truncated, one.ticks / 4);
    std::cout << fmt::format("{} {}: {} compared ({} edges, {} inside), {} open\n", one.name, generator, tally.compared,
                             tally.edges, tally.crossed, tally.open);
    return tally;
}

TEST_P(ContactGenerators, NearIsWhatTheSecondImplementationReports) {
    const Tally tally = tally_of(GetParam(), "proximity");
    EXPECT_EQ(tally.failures, "");
    EXPECT_GT(tally.compared, 40U);
    EXPECT_LT(tally.open, 3 * tally.compared);
}

TEST_P(ContactGenerators, TrackedProximityIsWhatTheSecondImplementationReports) {
    const Tally tally = tally_of(GetParam(), "tracked_proximity");
    EXPECT_EQ(tally.failures, "");
    EXPECT_GT(tally.compared, 100U);
    EXPECT_LT(tally.open, tally.compared / 10 + 10);
}

TEST(TrackedProximity, WhatHasCrossedNearAFreeRimStaysCrossedUntilItIsMoreBesideTheSheetThanBehindIt) {
    // A spike is driven 1 mm through a sheet whose rim is at x = 30 mm, under it to 0.1 mm beyond the rim, and to 3 mm.
    const Scene scene = scene_from_text(
        R"({"format":"trocar-scene-2","name":"rim","unit":"m","dt":0.001,"ticks":90,"seed":1,"bodies":[
      {"name":"sheet","kind":"rigid","closed":false,"parts":[{"shape":"sheet","size":[0.06,0.06],"edge":0.006}]},
      {"name":"spike","kind":"instrument","closed":false,
       "parts":[{"shape":"triangle","corners":[[0,0,0],[0.004,0.0003,0.02],[-0.004,0.0003,0.02]]}],
       "motion":{"drive":"prescribed","keys":[
        {"time":0,"pose":[0.0285,0.0007,0.001,0,0,0]},{"time":0.02,"pose":[0.0285,0.0007,-0.001,0,0,0]},
        {"time":0.03,"pose":[0.0285,0.0007,-0.001,0,0,0]},{"time":0.05,"pose":[0.0301,0.0007,-0.001,0,0,0]},
        {"time":0.06,"pose":[0.0301,0.0007,-0.001,0,0,0]},{"time":0.08,"pose":[0.033,0.0007,-0.001,0,0,0]},
        {"time":0.09,"pose":[0.033,0.0007,-0.001,0,0,0]}]}}]})");
    Simulation run(scene, make_detector("ohc"), make_response("none"),
                   registry().contact_generator("tracked_proximity"));
    const BodyRange& first = scene.topology.bodies[0];
    const Index tip = (first.kind == BodyKind::instrument ? first : scene.topology.bodies[1]).vertices.first;
    // The deepest contact is where the vertex has crossed, not a face beside; 0: reported as not crossed, or not at
    // all.
    const auto gap_of_tip_after = [&run, tip](std::int64_t ticks) {
        while (run.outcome().ok() && run.seen().tick + 1 < ticks) run.step();
        double deepest = 0.0;
        for (const Contact& contact : run.contacts().contacts) {
            const bool is_of_tip = !is_edges(contact) && static_cast<Index>(contact.id >> 32) == tip;
            if (is_of_tip) deepest = std::min(deepest, contact.gap);
        }
        return deepest;
    };
    EXPECT_NEAR(gap_of_tip_after(28), -0.001, 1e-12);
    EXPECT_NEAR(gap_of_tip_after(58), -std::hypot(0.0001, 0.001), 1e-12);
    EXPECT_EQ(gap_of_tip_after(88), 0.0);
    EXPECT_TRUE(run.outcome().ok()) << run.outcome().message;
}

TEST(PlaceAtStart, LeavesAContactOfWhichATriangleIsNotKnownAsItIs) {
    const Shape point = triangle(Vector3::Zero(), Vector3::Zero(), Vector3::Zero());
    const World world = make_world("two", {{BodyKind::instrument, point}, {BodyKind::tissue, point}});
    for (const auto& [a, b] : {std::pair<Index, Index>{0, -1}, {-1, 1}, {-1, -1}}) {
        Contact contact;
        contact.a = a;
        contact.b = b;
        place_at_start(TickStart(world.topology, world.frame), contact);
        EXPECT_EQ(contact.body_a, -1) << a << " " << b;
        EXPECT_EQ(contact.body_b, -1) << a << " " << b;
    }
}

constexpr Case cases[] = {
    {"OpenSheetDragged", "i2t_drag", 8.0, 110, 3, "penalty"},
    {"OpenSheetCrossedAndLeft", "i2t_stab", 2.0, 220, 7, "none"},
    {"DeepStartInASheet", "i2t_deep_sheet", 2.0, 60, 3, "none"},
    {"DeepStartInAClosedOrgan", "i2t_deep_start", 4.0, 80, 8, "none"},
    {"TwoTissues", "t2t_press", 8.0, 80, 6, "penalty"},
    {"ToolThatJumpsTwentyMillimetres", "jump", 1.0, 40, 1, "none"},
};

INSTANTIATE_TEST_SUITE_P(Scenes, ContactGenerators, testing::ValuesIn(cases),
                         [](const auto& tested) { return std::string(tested.param.name); });

/// A roof with its ridge along y: triangle 1 is level, triangle 2 falls away by an angle of this cosine and sine. An
/// upright blade, triangle 0, has its vertex 0 at `corner` and the two others at the same x, `others` high.
World blade_at_roof(const Vector3& corner, double others, double cosine, double sine) {
    const Shape blade = triangle(corner, {corner.x(), 0.25, others}, {corner.x(), 0.5, others});
    const Shape roof{{{0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {-1.0, 0.0, 0.0}, {cosine, 0.0, -sine}},
                     {{0, 1, 2}, {0, 3, 1}}};
    return make_world("blade at roof", {{.kind = BodyKind::instrument, .shape = blade, .closed = false},
                                        {.kind = BodyKind::rigid, .shape = roof, .closed = false}});
}

/// What `tracked_proximity` makes of the blade near both triangles of the roof.
std::vector<Contact> tracked_proximity_at_roof(const World& world, double query_distance) {
    const auto generator = make_contact_generator("tracked_proximity");
    generator->prepare(world.topology, world.frame);
    ContactSet contacts;
    contacts.near = {{0, 1}, {0, 2}};
    contacts.query_distance = query_distance;
    generator->gather(world.frame, contacts);
    return contacts.contacts;
}

TEST(TrackedProximity, AVertexOverAFaceIsHeldByTheFaceBesideItUnlessTheEdgeIsSharperThanSixtyDegrees) {
    // Vertex 0 of the tool is over the level one. All numbers are such that no rounding moves the 60 degrees.
    struct Fold {
        double cosine;
        double sine;
        bool is_held;
    };
    for (const Fold& fold : {Fold{0.6, 0.8, true}, Fold{0.5, 0.8660254037844387, true}, Fold{0.28, 0.96, false}}) {
        const std::vector<Contact> contacts =
            tracked_proximity_at_roof(blade_at_roof(Vector3(-0.25, 0.25, 0.25), 9.0, fold.cosine, fold.sine), 2.0);
        const auto reported = [&contacts](Index triangle) {
            return std::count_if(contacts.begin(), contacts.end(),
                                 [triangle](const Contact& one) { return feature_of(one) == point_face(0, triangle); });
        };
        EXPECT_EQ(reported(1), 1) << fold.cosine;
        EXPECT_EQ(reported(2), fold.is_held ? 1 : 0) << fold.cosine;
    }
}

TEST(TrackedProximity, AFaceBesideHasTheGapOfTheFaceOverWhichTheVertexIsAndHowMuchFurtherItIs) {
    // The corner is 0.24 from the ridge and 0.1 above or below the level face, so that the other face, of which the
    // ridge is nearest, is 0.26 away. Where the blade passes through, its corner has crossed and both faces' fronts are
    // where it has to go; where it is all below, it is over their backs.
    struct Place {
        double height;
        double others;
        double gap;
        double gap_beside;
        double front;
    };
    for (const Place& place : {Place{0.1, 9.0, 0.1, 0.26, 1.0}, Place{-0.1, 9.0, -0.1, -0.1 + 0.16, 1.0},
                               Place{-0.1, -9.0, 0.1, 0.26, -1.0}}) {
        const auto scene = blade_at_roof(Vector3(-0.24, 0.25, place.height), place.others, 0.6, 0.8);
        for (const double query_distance : {2.0, 0.5}) {
            SCOPED_TRACE(
                fmt::format("height {}, others {}, query distance {}", place.height, place.others, query_distance));
            const std::vector<Contact> contacts = tracked_proximity_at_roof(scene, query_distance);
            const auto reported = [&contacts](Index triangle) {
                return std::find_if(contacts.begin(), contacts.end(), [triangle](const Contact& one) {
                    return feature_of(one) == point_face(0, triangle);
                });
            };
            const auto over = reported(1);
            ASSERT_NE(over, contacts.end());
            EXPECT_NEAR(over->gap, place.gap, 1e-12);
            EXPECT_LT((over->normal + place.front * Vector3(0.0, 0.0, 1.0)).norm(), 1e-12);
            const auto beside = reported(2);
            // A fifth of the short query distance is less than the extra distance of that face, with and without what
            // has crossed.
            ASSERT_EQ(beside != contacts.end(), query_distance == 2.0);
            if (beside == contacts.end()) continue;
            EXPECT_NEAR(beside->gap, place.gap_beside, 1e-12);
            EXPECT_LT((beside->normal + place.front * Vector3(0.8, 0.0, 0.6)).norm(), 1e-12);
        }
    }
}

}  // namespace
}  // namespace trocar::test
