// Runs that blow up by their contacts while every number stays finite end `unstable`, by a rule that knows no method;
// runs that do not, do not. That a run has blown up is shown by other means: force, strain or energy beyond what the
// scene can give, with the rule switched off.
#include "simulate/blow_up.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "method/registry.hpp"
#include "simulate/simulation.hpp"
#include "support/created_energy.hpp"
#include "support/methods.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"
#include "support/shapes.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;

struct Watched {
    Outcome outcome;
    std::int64_t ticks = 0;
    double most_force = 0.0;   ///< N
    double most_strain = 0.0;  ///< geometry's, not what the stepper reports
    double created = 0.0;      ///< J, from nowhere
};

Watched run_watched(const Scene& scene, const std::string& response, std::int64_t ticks, bool watched) {
    const MethodSpec spec = parse_method(response);
    // Contacts of meeting triangles where the response reads them: they come late, and let go all at once.
    const ContactGeneratorEntry& source = registry().contact_generator(test::meeting_triangles_or_own(spec));
    Simulation simulation(scene, make_detector("ohc_clustered"), make_response(response), source, {.watched = watched});
    test::CreatedEnergy created(scene);
    Watched result;
    for (; result.ticks < ticks; ++result.ticks) {
        const StepRow row = simulation.step();
        result.outcome = simulation.outcome();
        if (!result.outcome.ok()) break;
        result.most_force = std::max(result.most_force, row.tool_force.norm());
        const Matrix3X& position = simulation.frame().position;
        for (const Spring& spring : scene.materials.springs) {
            const double length = (position.col(spring.j) - position.col(spring.i)).norm();
            result.most_strain = std::max(result.most_strain, length / spring.rest - 1.0);
        }
        created.observe(simulation);
    }
    result.created = std::isfinite(created.largest()) ? created.largest() : 0.0;
    return result;
}

/// The sheet of i2t_poke as a square grid whose middle vertex has a twin 1 µm beside it.
Scene micron_edge() {
    test::Shape sheet = test::sheet(0.1, 20);
    const Index middle = 10 * 21 + 10;
    const Index right = middle + 1;
    const auto twin = static_cast<Index>(sheet.vertices.size());
    sheet.vertices.emplace_back(1e-6, 0.0, 0.0);
    test::Faces faces;
    for (const auto& face : sheet.triangles) {
        const bool has_edge =
            std::count(face.begin(), face.end(), middle) == 1 && std::count(face.begin(), face.end(), right) == 1;
        faces.push_back(face);
        if (!has_edge) continue;
        std::replace(faces.back().begin(), faces.back().end(), middle, twin);
        faces.push_back(face);
        std::replace(faces.back().begin(), faces.back().end(), right, twin);
    }
    sheet.triangles = faces;
    const test::TemporaryFolder folder;
    write_obj(folder.path() / "sheet.obj", sheet);
    Json scene = test::shipped_json("i2t_poke");
    scene["bodies"][0]["parts"] = Json::array({{{"mesh", "sheet.obj"}}});
    std::ofstream(folder.path() / "scene.json") << scene.dump();
    return read_scene(folder.path() / "scene.json", std::nullopt);
}

Scene poke(double k, double youngs_modulus) {
    Json scene = test::shipped_json("i2t_poke");
    scene["contact"][0]["k"] = k;
    scene["bodies"][0]["tissue"]["youngs_modulus"] = youngs_modulus;
    return test::scene_from_text(scene.dump());
}

/// The two sheets of t2t_press, the lower one turned about y by this angle (degrees) through the upper one.
Scene crossed_sheets(double angle) {
    Json scene = test::shipped_json("t2t_press");
    scene["bodies"][1]["pose"] = {0.0017, 0.0009, 0.0, 0.0, angle, 7.0};
    return test::scene_from_text(scene.dump());
}

/// i2t_grasp with all lengths but the tissue's thickness ten times as large.
Scene large_grasp() {
    Json scene = test::shipped_json("i2t_grasp");
    const auto scale = [](Json& list, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) list[i] = 10.0 * list[i].get<double>();
    };
    for (Json& body : scene["bodies"]) {
        for (const char* point : {"trocar", "tip"}) {
            if (body.contains(point)) scale(body[point], 3);
        }
        for (Json& part : body["parts"]) {
            for (const char* length : {"radius", "length", "edge"}) {
                if (part.contains(length)) part[length] = 10.0 * part[length].get<double>();
            }
            if (part.contains("pose")) scale(part["pose"], 3);
        }
        if (!body.contains("motion")) continue;
        for (Json& key : body["motion"]["keys"]) scale(key["pose"], 3);
    }
    return test::scene_from_text(scene.dump());
}

constexpr double usual_k = 100.0;          // N/m
constexpr double usual_modulus = 38000.0;  // Pa

struct BlowUpCase {
    std::string name;
    std::function<Scene()> scene;
    std::string response;
    const char* cause;  ///< a word of the sentence
};

class BlowsUp : public testing::TestWithParam<BlowUpCase> {};

/// What cannot be: more than all springs of the sheet at twice their length hold (0.6 J of 100 N/m × 5 mm each), five
/// times its strain limit, or a force of more than 100 N on a membrane of 114 N/m × 0.4 m rim (E h times perimeter) at
/// the modulus of the scenes; at the thousandfold modulus energy alone is asked: 1 J where a path of 4 mm at 100 N is
/// 0.4.
bool has_blown_up(const Watched& unwatched) {
    return !unwatched.outcome.ok() || unwatched.most_strain > 5.0 || unwatched.most_force > 100.0 ||
           unwatched.created > 0.01;
}

TEST_P(BlowsUp, EndsUnstableWithItsCause) {
    const BlowUpCase& given = GetParam();
    if (!test::is_registered(registry().responses(), parse_method(given.response).name))
        GTEST_SKIP() << given.response << " is absent";
    const Scene scene = given.scene();
    const Watched unwatched = run_watched(scene, given.response, scene.ticks, false);
    EXPECT_TRUE(has_blown_up(unwatched)) << unwatched.most_force << " N, strain " << unwatched.most_strain << ", "
                                         << unwatched.created << " J";
    const Watched watched = run_watched(scene, given.response, scene.ticks, true);
    ASSERT_EQ(watched.outcome.kind, OutcomeKind::unstable) << given.response;
    EXPECT_NE(watched.outcome.message.find(given.cause), std::string::npos) << watched.outcome.message;
    if (unwatched.outcome.ok()) {
        EXPECT_LT(watched.ticks, unwatched.ticks);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Cases, BlowsUp,
    testing::Values(
        BlowUpCase{"held_over_the_tick", [] { return poke(usual_k, usual_modulus); },
                   "thesis:profile=faithful,contacts=zero_order_hold", "energy from nothing"},
        BlowUpCase{"stiff_contact_faithful", [] { return poke(1e9, usual_modulus); }, "thesis:profile=faithful",
                   "strain of"},
        BlowUpCase{"stiff_contact_ode", [] { return poke(1e9, usual_modulus); }, "ode_joints", "energy from nothing"},
        BlowUpCase{"stiff_tissue_reflection", [] { return poke(usual_k, 38e6); }, "reflection", "energy from nothing"},
        BlowUpCase{"stiff_tissue_xpbd", [] { return poke(usual_k, 38e6); }, "xpbd_contact", "energy from nothing"},
        BlowUpCase{"micron_edge_corrected", micron_edge, "thesis:profile=corrected", "energy from nothing"},
        BlowUpCase{"micron_edge_reflection", micron_edge, "reflection", "energy from nothing"},
        BlowUpCase{"large_grasp_held_over_the_tick", large_grasp, "thesis:profile=faithful,contacts=zero_order_hold",
                   "can carry"},
        BlowUpCase{"crossed_upright", [] { return crossed_sheets(90.0); }, "reflection", "can carry"}),
    [](const auto& one) { return one.param.name; });

/// The first 600 ticks of every shipped scene with tissue, `unilateral` as it is by default.
TEST(BlowUp, ShippedScenesAreNoneUnderUnilateral) {
    int asked = 0;
    for (const std::string& name : test::scene_names()) {
        if (lacks_data(test::scene_file(name), std::nullopt)) continue;
        const Scene scene = test::shipped_scene(name);
        if (!scene.has_tissue()) continue;
        const Watched held = run_watched(scene, "unilateral", std::min<std::int64_t>(scene.ticks, 600), true);
        EXPECT_TRUE(held.outcome.ok()) << scene.name << ": " << held.outcome.message;
        ++asked;
    }
    EXPECT_GT(asked, 15);
}

/// The same scenes under a response that bears them, and a stiff contact, a micron and a deep start that are no fault.
TEST(BlowUp, WhatHoldsIsLeftAlone) {
    for (const auto& scene : {poke(1e9, usual_modulus), poke(usual_k, 38e6), micron_edge(), large_grasp(),
                              test::shipped_scene("i2t_deep_start"), test::shipped_scene("i2t_deep_sheet")}) {
        const Watched held = run_watched(scene, "unilateral", scene.ticks, true);
        EXPECT_TRUE(held.outcome.ok()) << scene.name << ": " << held.outcome.message;
    }
}

/// A stepper shows the far part of an organ late: where that meets what is not late, springs are stretched by nothing
/// that anybody did. The verdict and the audit are of the tissue without that.
TEST(BlowUp, WhatIsShownLateIsNoEnergyFromNothing) {
    const Scene scene = read_scene(
        std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/studies/scenes/size/size_organ_12k.json", std::nullopt);
    Simulation simulation(scene, make_detector("ohc_clustered"), make_response("unilateral"),
                          registry().contact_generator(default_contact_generator(parse_method("unilateral"))),
                          {.stepper = parse_method("adaptive_multires"), .watched = true});
    const double start = potential_energy(scene.materials, scene.first.position);
    const auto gain = [&](const Frame& frame) { return potential_energy(scene.materials, frame.position) - start; };
    double shown = 0.0;
    double whole = 0.0;
    for (int tick = 0; tick < 120; ++tick) {
        simulation.step();
        ASSERT_TRUE(simulation.outcome().ok()) << tick << ": " << simulation.outcome().message;
        shown = std::max(shown, gain(simulation.frame()));
        whole = std::max(whole, gain(simulation.whole_frame()));
    }
    EXPECT_GT(shown, 5.0 * whole) << "nothing was late: this says nothing";
}

/// A driven tool of one vertex and a tissue of two springs in a row with round figures.
struct TwoSprings {
    Scene scene;
    Frame seen;
    Frame after;
    ContactSet contacts;
    ResponseOutput output;
    std::vector<ContactForce> contact_forces;
    std::vector<Wrench> reaction;

    TwoSprings() {
        scene.topology =
            make_topology({Body{.name = "tool", .kind = BodyKind::instrument, .vertex_count = 1},
                           Body{.name = "tissue", .kind = BodyKind::tissue, .closed = false, .vertex_count = 3}});
        scene.bodies.resize(2);
        scene.bodies[0].motion.emplace();
        Materials& materials = scene.materials;
        materials.springs = {{.i = 1, .j = 2, .rest = 0.01, .k = 100.0, .preload = 0.2},
                             {.i = 2, .j = 3, .rest = 0.02, .k = 50.0, .preload = 0.1}};
        materials.mass = {0.0, 0.004, 0.005, 0.001};
        materials.area = {0.0, 4e-5, 5e-5, 1e-5};
        materials.drag.assign(4, 0.0);
        materials.pinned.assign(4, 0);
        materials.rest_bias = Matrix3X::Zero(3, 4);
        seen.position = Matrix3X::Zero(3, 4);
        seen.velocity = Matrix3X::Zero(3, 4);
        seen.position.row(0) << 0.0, 0.0, 0.01, 0.03;
        seen.previous = seen.position;
        after = seen;
        output.resize(4, 2);
        reaction.resize(2);
    }
    void tool_has_come(double path) { seen.previous(1, 0) = seen.position(1, 0) - path; }
    void stretch(double first, double second) {
        after.position(0, 2) = 0.01 * (1.0 + first);
        after.position(0, 3) = after.position(0, 2) + 0.02 * (1.0 + second);
    }
    [[nodiscard]] Outcome judged() const {
        const EnergyMomentumAudit nothing_done(scene);
        return BlowUp(scene).judge(seen, after, contacts, output, contact_forces, reaction, nothing_done);
    }
};

TEST(BlowUp, AToolBearsNoMoreThanAllSpringsCarryAndTheTissuesMassIsBrought) {
    // 2 Σ (k s L + T) L / √A, √A = 10 mm, with s = 1, 2 and 3: Σ = 0.012 + 0.022, 0.022 + 0.042, 0.032 + 0.062 N m; and
    // 10 g that in a tick of 1 ms get the displacement of the tool.
    const double endless = std::numeric_limits<double>::infinity();
    for (const auto& [limit, carried] : {std::pair{0.5, 6.8}, {1.0, 6.8}, {2.0, 12.8}, {3.5, 18.8}, {endless, 18.8}}) {
        for (const double path : {0.0, 1e-4, 3e-4}) {
            TwoSprings given;
            given.scene.materials.strain_limit = limit;
            given.tool_has_come(path);
            given.reaction[1].force = Vector3(0.0, 0.0, 1e6);  // no tool
            const double most = carried + 0.01 * path / 1e-6;
            for (const double factor : {0.999, 1.001}) {
                for (const double share : {1.0, 0.25}) {  // by tissue, and by what the response says beside it
                    const Vector3 force = factor * most * Vector3(0.6, 0.0, -0.8);
                    given.reaction[0].force = share * force;
                    given.output.wrench[0].force = (1.0 - share) * force;
                    const Outcome outcome = given.judged();
                    EXPECT_EQ(outcome.ok(), factor < 1.0) << limit << ' ' << path << ": " << outcome.message;
                    EXPECT_EQ(outcome.message.find("can carry") != std::string::npos, factor > 1.0);
                }
            }
        }
    }
}

TEST(BlowUp, WhatCanCarryNothingIsLeftAloneUntilItShowsAForce) {
    TwoSprings slack;
    for (Spring& spring : slack.scene.materials.springs) spring.k = spring.preload = 0.0;
    EXPECT_TRUE(slack.judged().ok()) << slack.judged().message;
    slack.reaction[0].force = Vector3(0.0, 1e-9, 0.0);
    EXPECT_EQ(slack.judged().kind, OutcomeKind::unstable);
}

TEST(BlowUp, AnEdgeIsStretchedNoFurtherThanItsLimitAndThePathOfWhatIsDriven) {
    // The mean rest length is 15 mm: the edge of 10 mm shares the displacement with its neighbour, that of 20 mm does
    // not.
    for (const auto& [limit, strain] :
         {std::pair{0.5, 3.0}, {5.0, 5.0}, {std::numeric_limits<double>::infinity(), 3.0}}) {
        for (const bool touched : {false, true}) {
            TwoSprings given;
            given.scene.materials.strain_limit = limit;
            given.tool_has_come(0.0045);
            Contact deepest;
            deepest.depth = 0.003;
            given.contacts.contacts = {Contact{}, deepest};
            given.contact_forces.resize(1);
            if (touched) given.contact_forces[0].force = Vector3(0.0, 0.0, 1e-3);
            const double path = touched ? 0.0075 : 0.003;
            for (const double factor : {0.999, 1.001}) {
                given.stretch(factor * (strain + path / 0.015), 0.0);
                EXPECT_EQ(given.judged().ok(), factor < 1.0) << limit << ' ' << touched;
                given.stretch(0.0, factor * (strain + path / 0.02));
                const Outcome outcome = given.judged();
                EXPECT_EQ(outcome.ok(), factor < 1.0) << limit << ' ' << touched;
                EXPECT_EQ(outcome.message.find("strain of") != std::string::npos, factor > 1.0) << outcome.message;
            }
        }
    }
}

/// Bits of a run do not depend on whether it is watched.
TEST(BlowUp, WatchingChangesNothing) {
    const Scene scene = test::scene_from_text(test::poke_text());
    std::array<std::uint64_t, 2> hash{};
    for (const bool watched : {false, true}) {
        Simulation simulation(scene, make_detector("ohc"), make_response("penalty"),
                              registry().contact_generator("intersection"), {.watched = watched});
        for (int tick = 0; tick < 60; ++tick) simulation.step();
        ASSERT_TRUE(simulation.outcome().ok());
        hash.at(watched ? 1 : 0) = simulation.frame().hash();
        EXPECT_EQ(simulation.audit_figures().empty(), !watched);
    }
    EXPECT_EQ(hash[0], hash[1]);
}

}  // namespace
}  // namespace trocar
