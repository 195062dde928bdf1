// Contact between bodies that do not deform, as `unilateral` shares it out over a patch: closed forms of ball, wedge
// and blade.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "method/registry.hpp"
#include "simulate/simulation.hpp"
#include "support/known_gap.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

/// A shape driven to (0.0021, 0.0013, z) over the top (z = 0) of a rigid block whose edges are `edge` long.
std::string over_a_block(const std::string& part, double edge, double z, const std::string& drive,
                         const std::string& turn = "0,0,0", bool closed = true) {
    return fmt::format(
        R"({{"format":"trocar-scene-2","name":"block","unit":"m","dt":0.001,"ticks":10,"seed":1,"bodies":[
      {{"name":"block","kind":"rigid","closed":true,"parts":[{{"shape":"box","size":[0.05,0.05,0.02],"edge":{0}}}],
       "pose":[0,0,-0.01,0,0,0]}},
      {{"name":"tool","kind":"instrument","closed":{5},"parts":[{1}],
       "motion":{{"drive":"{2}","keys":[{{"time":0,"pose":[0.0021,0.0013,{3},{4}]}}]}}}}],
      "contact":[{{"bodies":["tool","block"],"k":1000,"mu":0}}]}})",
        edge, part, drive, z, turn, closed);
}

StepRow last_row(const std::string& text, const std::string& method, int ticks, double* depth = nullptr) {
    const Scene scene = test::scene_from_text(text);
    Simulation simulation(scene, make_detector("brute_force"), make_response(method),
                          registry().contact_generator(default_contact_generator(parse_method(method))));
    StepRow row;
    for (int tick = 0; tick < ticks; ++tick) row = simulation.step();
    if (depth != nullptr) {
        const Range tool = scene.topology.bodies[0].vertices;
        *depth = -simulation.frame().position.row(2).segment(tool.first, tool.count).minCoeff();
    }
    return row;
}

constexpr const char* unilateral = "unilateral";

TEST(RigidPatch, BallOnAPlaneGivesStiffnessTimesDepthAtAnyMesh) {
    // I18 for tools and bone: k d upwards, where d is how deep the polyhedron's lowest vertex is.
    for (const double edge : {0.02, 0.005, 0.0025}) {
        for (const double ball_edge : {0.005, 0.0025, 0.00125}) {
            const std::string part = fmt::format(R"({{"shape":"sphere","radius":0.009,"edge":{}}})", ball_edge);
            double depth = 0.0;
            const StepRow row = last_row(over_a_block(part, edge, 0.0085, "prescribed"), unilateral, 2, &depth);
            ASSERT_GT(depth, 1e-4);
            EXPECT_LT((row.tool_force - Vector3(0.0, 0.0, 1000.0 * depth)).norm(), 1e-9) << edge << " " << ball_edge;
            EXPECT_LT(std::abs(row.tool_force.z() - 0.5), ball_edge < 0.002 ? 0.05 : 0.25);
        }
    }
}

TEST(RigidPatch, TiltedBoxPressesAlongThePlanesNormalWithItsLowestCorner) {
    for (const double edge : {0.02, 0.005}) {
        const std::string part = R"({"shape":"box","size":[0.02,0.02,0.02],"edge":0.005})";
        double depth = 0.0;
        const StepRow row = last_row(over_a_block(part, edge, 0.0105, "prescribed", "9,5,0"), unilateral, 2, &depth);
        ASSERT_GT(depth, 1e-3);
        EXPECT_LT((row.tool_force - Vector3(0.0, 0.0, 1000.0 * depth)).norm(), 1e-9);
    }
}

TEST(RigidPatch, ForceFollowsTheDepthSmoothlyAsABallSinksIn) {
    // 10 um a step: k d changes by 0.01 N while the curve runs over edge after edge.
    double last = 0.0;
    for (int step = 0; step < 60; ++step) {
        const double z = 0.009 - 1e-5 * step;
        const StepRow row = last_row(
            over_a_block(R"({"shape":"sphere","radius":0.009,"edge":0.002})", 0.004, z, "prescribed"), unilateral, 2);
        EXPECT_LT(row.tool_force.head<2>().norm(), 1e-9);
        if (step > 0) {
            EXPECT_LE(row.tool_force.z() - last, 0.01 + 1e-9);
            EXPECT_GE(row.tool_force.z() - last, last > 0.0 ? 0.01 - 1e-9 : 0.0);
        }
        last = row.tool_force.z();
    }
    EXPECT_GT(last, 0.3);
}

/// Two triangles, 12 mm wide, upright in the plane y = 0 above the tool's origin.
constexpr const char* blade = R"({"shape":"sheet","size":[0.012,0.012],"edge":0.012,"pose":[0,0,0.006,90,0,0]})";

TEST(RigidPatch, GapOpenBladeIsPushedOutOfTheFaceItCutsWhereverItsDiagonalLies) {
    test::expect_known_gap(
        "an open blade in bone shows 29 N: its sides are those of a sheet that the bone crosses", [] {
            // Blocks whose faces are two triangles have their diagonal under the blade: edges cross there, and their
            // cross product points along the face. From both sides, on an edge and on a corner of the blade.
            for (const double edge : {0.05, 0.005}) {
                for (const char* turn :
                     {"0,0,0", "0,0,45", "0,0,-45", "0,0,135", "0,0,-150", "30,0,0", "0,30,0", "0,-30,0"}) {
                    double depth = 0.0;
                    const StepRow row =
                        last_row(over_a_block(blade, edge, -0.0017, "prescribed", turn, false), unilateral, 2, &depth);
                    ASSERT_GT(depth, 1e-3) << turn;
                    EXPECT_LT((row.tool_force - Vector3(0.0, 0.0, 1000.0 * depth)).norm(), 1e-9) << edge << " " << turn;
                }
            }
        });
}

TEST(RigidPatch, OpenBladeOverTheEdgeOfABlockIsPushedAlongBothFaces) {
    // The lower edge of the blade cuts the block's edge off at 45 degrees, 2 mm from it on both faces: no corner of
    // the blade is inside, and along (1, 0, 1) it is sqrt(2) mm deep.
    std::string text = over_a_block(blade, 0.05, -0.001, "prescribed", "0,45,0", false);
    const std::string place = "0.0021,0.0013,-0.001";
    text.replace(text.find(place), place.size(), "0.024,0.0013,-0.001");
    const StepRow row = last_row(text, unilateral, 2);
    EXPECT_LT((row.tool_force - Vector3(1.0, 0.0, 1.0)).norm(), 1e-9) << row.tool_force.transpose();
}

TEST(RigidPatch, OpenBladeDrivenByAnOperatorGetsNoEnergyOnItsPathInAndOut) {
    for (const char* turn : {"0,0,0", "0,0,45", "0,0,-45", "10,5,20", "30,0,0"}) {
        std::string text = over_a_block(blade, 0.05, 0.008, "operator", turn, false);
        const std::string high = fmt::format("[0.0021,0.0013,0.008,{}]", turn);
        const std::string low = fmt::format("[0.0021,0.0013,-0.003,{}]", turn);
        const std::string keys = fmt::format(
            R"(,{{"time":0.05,"pose":{1}}},{{"time":0.2,"pose":{1}}},{{"time":0.25,"pose":{0}}})", high, low);
        text.insert(text.find(high) + high.size() + 1, keys);
        const Scene scene = test::scene_from_text(text);
        Simulation simulation(scene, make_detector("brute_force"), make_response(unilateral),
                              registry().contact_generator(default_contact_generator(parse_method(unilateral))));
        double work = 0.0;
        double most = 0.0;
        double pressed = 0.0;
        double aside = 0.0;
        for (int tick = 0; tick < 400; ++tick) {
            const Vector3 before = simulation.frame().position.col(0);
            const StepRow row = simulation.step();
            work += row.tool_force.dot(simulation.frame().position.col(0) - before);
            most = std::max(most, work);
            pressed = std::max(pressed, row.tool_force.z());
            aside = std::max(aside, row.tool_force.head<2>().norm());
        }
        EXPECT_GT(pressed, 0.5) << turn;
        EXPECT_LT(aside, 1e-9) << turn;
        EXPECT_LT(most, 1e-9) << turn;
    }
}

}  // namespace
}  // namespace trocar
