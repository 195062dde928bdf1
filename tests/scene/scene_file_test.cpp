#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "scene/retired_names.hpp"
#include "scene/scene.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;

/// The example of DESIGN §10 with a shape in place of the mesh file.
Json example() {
    return Json::parse(R"({"format":"trocar-scene-2","name":"example","unit":"m","dt":0.001,"ticks":500,"seed":1,
 "bodies":[
  {"name":"sheet","kind":"tissue","closed":false,
   "parts":[{"shape":"sheet","size":[0.1,0.1],"edge":0.005}],
   "tissue":{"youngs_modulus":38000,"thickness":0.003,"density":1060,"preload":0.2,"pinned":"rim"}},
  {"name":"tool","kind":"instrument","closed":true,"trocar":[0,0,0.2],
   "parts":[{"shape":"shaft","radius":0.004,"length":0.1,"edge":0.004,"scale":1,"pose":[0,0,0,0,0,0]}],
   "motion":{"drive":"prescribed","keys":[{"time":0,"pose":[0,0,0.01,0,0,0]},{"time":0.5,"pose":[0,0,-0.004,0,0,0]}]}}],
 "contact":[{"bodies":["tool","sheet"],"k":100,"mu":2}]})");
}

class SceneFile : public testing::Test {
protected:
    Scene read(const Json& document) { return read_text(document.dump()); }
    Scene read_text(const std::string& text) { return read_scene(folder.write("scene.json", text), std::nullopt); }
    /// The complaint, without the folder; empty when there was none.
    std::string complaint_about(const std::string& text) {
        return test::complaint_about(folder.path() / "scene.json", [&] { read_text(text); });
    }
    test::TemporaryFolder folder;
};

TEST_F(SceneFile, ExampleOfTheDesignIsRead) {
    const Scene scene = read(example());
    EXPECT_EQ(scene.name, "example");
    EXPECT_EQ(scene.ticks, 500);
    ASSERT_EQ(scene.topology.body_count(), 2);
    EXPECT_EQ(scene.topology.bodies[0].name, "tool") << "instruments come first";
    EXPECT_EQ(scene.topology.bodies[1].name, "sheet");
    EXPECT_FALSE(scene.topology.bodies[1].closed);
    EXPECT_EQ(scene.materials.contact_laws.at(0).k, 100.0);
    EXPECT_EQ(scene.materials.contact_laws.at(0).mu, 2.0);
    EXPECT_EQ(*scene.materials.trocar_point[0], Vector3(0, 0, 0.2));
    EXPECT_FALSE(scene.materials.trocar_point[1].has_value());
    const Range tool = scene.topology.bodies[0].vertices;
    EXPECT_NEAR(scene.first.position.row(2).segment(tool.first, tool.count).minCoeff(), 0.01, 1e-15);
    EXPECT_EQ(scene.first.previous, scene.first.position);
}

TEST_F(SceneFile, ABodyThatAnOperatorLeadsHasItsModel) {
    Json document = example();
    const std::vector<SceneBody> by_script = read(document).bodies;
    ASSERT_EQ(by_script.size(), 2U);
    ASSERT_TRUE(by_script[0].motion.has_value());
    EXPECT_EQ(by_script[0].motion->drive, Drive::prescribed);
    EXPECT_FALSE(by_script[1].motion.has_value());
    Json& motion = document["bodies"][1]["motion"];
    motion["drive"] = "operator";
    motion["operator"] = {{"mass", 0.25}, {"damping", 3.0}};
    const std::vector<SceneBody> by_operator = read(document).bodies;
    ASSERT_TRUE(by_operator.at(0).motion.has_value()) << "the tool comes first";
    EXPECT_EQ(by_operator[0].motion->drive, Drive::simulated_operator);
    EXPECT_EQ(by_operator[0].motion->coupling.mass, 0.25);
    EXPECT_EQ(by_operator[0].motion->coupling.damping, 3.0);
    EXPECT_FALSE(by_operator.at(1).motion.has_value());
}

TEST_F(SceneFile, SpringsOfTheEquilateralInteriorFollowVanGelder) {
    const Scene scene = read(example());
    const Materials& m = scene.materials;
    const double nominal = std::sqrt(0.75) * 38000 * 0.003;  // METHODS §4, equilateral
    int interior = 0;
    double total_mass = 0.0;
    for (const Spring& spring : m.springs) {
        EXPECT_LT(spring.i, spring.j);
        EXPECT_DOUBLE_EQ(spring.preload, 0.2 * spring.k * spring.rest);
        EXPECT_EQ(spring.damping, 0.02);
        const bool inside =
            m.pinned[static_cast<std::size_t>(spring.i)] == 0 && m.pinned[static_cast<std::size_t>(spring.j)] == 0;
        if (!inside) continue;
        // The lattice is stretched to fit 0.1 m: 23 rows of 4.348 mm instead of 4.330.
        EXPECT_NEAR(spring.k, nominal, 0.02 * nominal);
        ++interior;
    }
    EXPECT_GT(interior, 500);
    for (const double mass : m.mass) total_mass += mass;
    EXPECT_NEAR(total_mass, 1060 * 0.003 * 0.01, 1e-12);
    // Euler: edges of a disc = vertices + triangles - 1.
    const BodyRange& sheet = scene.topology.bodies[1];
    EXPECT_EQ(static_cast<Index>(m.springs.size()), sheet.vertices.count + sheet.triangles.count - 1);
}

TEST_F(SceneFile, RestStateIsStaticAndOnlyTheRimIsPinned) {
    const Scene scene = read(example());
    const Materials& m = scene.materials;
    Matrix3X force = m.rest_bias;
    for (const Spring& spring : m.springs) {
        const Vector3 u = (scene.first.position.col(spring.j) - scene.first.position.col(spring.i)).normalized();
        force.col(spring.i) += spring.preload * u;
        force.col(spring.j) -= spring.preload * u;
    }
    const Range sheet = scene.topology.bodies[1].vertices;
    for (Index v = 0; v < scene.topology.vertex_count; ++v) {
        const Vector3 p = scene.first.position.col(v);
        const bool rim = std::fabs(p.x()) == 0.05 || std::fabs(p.y()) == 0.05;
        EXPECT_EQ(m.pinned[static_cast<std::size_t>(v)] != 0, sheet.contains(v) && rim) << v;
        if (sheet.contains(v) && !rim) {
            EXPECT_LT(force.col(v).norm(), 1e-12) << v;
        }
        EXPECT_EQ(m.mass[static_cast<std::size_t>(v)] > 0.0, sheet.contains(v));
    }
}

TEST_F(SceneFile, UnitScalesEveryLength) {
    Json in_mm = example();
    in_mm["unit"] = "mm";
    in_mm[Pointer("/bodies/0/parts/0/size")] = {100, 100};
    in_mm[Pointer("/bodies/0/parts/0/edge")] = 5;
    in_mm[Pointer("/bodies/0/tissue/thickness")] = 3;
    in_mm[Pointer("/bodies/1/trocar")] = {0, 0, 200};
    in_mm[Pointer("/bodies/1/tip")] = {1, 2, -50};
    in_mm[Pointer("/bodies/1/parts/0/radius")] = 4;
    in_mm[Pointer("/bodies/1/parts/0/length")] = 100;
    in_mm[Pointer("/bodies/1/parts/0/edge")] = 4;
    in_mm[Pointer("/bodies/1/motion/keys/0/pose/2")] = 10;
    in_mm[Pointer("/bodies/1/motion/keys/1/pose/2")] = -4;
    Json in_m = example();
    in_m[Pointer("/bodies/1/tip")] = {0.001, 0.002, -0.05};
    const Scene metres = read(in_m);
    const Scene millimetres = read(in_mm);
    ASSERT_EQ(metres.topology.triangles, millimetres.topology.triangles);
    EXPECT_LT((metres.first.position - millimetres.first.position).cwiseAbs().maxCoeff(), 1e-16);
    EXPECT_NEAR(metres.materials.springs[7].k, millimetres.materials.springs[7].k, 1e-10);
    EXPECT_NEAR(metres.bodies[0].motion->keys[1].translation.z(), millimetres.bodies[0].motion->keys[1].translation.z(),
                1e-18);
    for (const Scene* scene : {&metres, &millimetres}) {
        EXPECT_LT((scene->materials.tip[0] - Vector3(0.001, 0.002, -0.05)).norm(), 1e-16);
        ASSERT_TRUE(scene->materials.trocar_point[0].has_value());
        EXPECT_LT((*scene->materials.trocar_point[0] - Vector3(0.0, 0.0, 0.2)).norm(), 1e-16);
    }
}

TEST_F(SceneFile, PartPoseComesBeforeBodyPose) {
    const Scene scene = read(Json::parse(R"({"format":"trocar-scene-2","name":"n","ticks":1,"bodies":[{"name":"a",
        "kind":"rigid","pose":[0,0,1,0,0,90],"parts":[{"shape":"triangle","corners":[[1,0,0],[2,0,0],[1,1,0]],
        "scale":2,"pose":[1,0,0,90,0,0]}]}]})"));
    // (1,1,0) · 2 = (2,2,0); about x: (2,0,2); + (1,0,0): (3,0,2); about z: (0,3,2); + (0,0,1): (0,3,3).
    EXPECT_LT((scene.first.position.col(2) - Vector3(0, 3, 3)).norm(), 1e-15);
    EXPECT_FALSE(scene.topology.bodies[0].closed) << "an open shape makes an open body";
    EXPECT_TRUE(scene.materials.springs.empty());
    EXPECT_TRUE(scene.materials.mass.empty());
}

TEST_F(SceneFile, JawsSwingAboutTheHingeInOppositeDirections) {
    Json document =
        Json::parse(R"({"format":"trocar-scene-2","name":"n","ticks":1,"bodies":[{"name":"a","kind":"instrument",
        "hinge":{"point":[0,0,1],"axis":[2,0,0],"angle":90},
        "parts":[{"shape":"triangle","corners":[[0,0,1],[1,0,1],[0,0,3]],"jaw":"left"},
                 {"shape":"triangle","corners":[[0,0,1],[1,0,1],[0,0,3]],"jaw":"right"},
                 {"shape":"triangle","corners":[[0,0,1],[1,0,1],[0,0,3]]}],
        "motion":{"drive":"prescribed","keys":[{"time":0,"pose":[5,0,0,0,0,0],"jaw":1},{"time":1,"pose":[5,0,0,0,0,0],"jaw":0}]}}]})");
    const Scene scene = read(document);
    // Corner 2 is 2 above the hinge; +90 degrees about x takes +z to -y.
    EXPECT_LT((scene.first.position.col(2) - Vector3(5, -2, 1)).norm(), 1e-15);
    EXPECT_LT((scene.first.position.col(5) - Vector3(5, 2, 1)).norm(), 1e-15);
    EXPECT_LT((scene.first.position.col(8) - Vector3(5, 0, 3)).norm(), 1e-15);
    Matrix3X position = scene.first.position;
    place_body(scene.bodies[0], scene.topology.bodies[0].vertices, scene.bodies[0].motion->pose_at(1.0), position);
    EXPECT_LT((position.col(2) - Vector3(5, 0, 3)).norm(), 1e-15);
    EXPECT_LT((position.col(5) - Vector3(5, 0, 3)).norm(), 1e-15);
}

TEST_F(SceneFile, VertexNumbersPinThoseVertices) {
    Json document = example();
    document[Pointer("/bodies/0/tissue/pinned")] = {3, 17};
    const Scene scene = read(document);
    const Index first = scene.topology.bodies[1].vertices.first;
    for (Index v = 0; v < scene.topology.vertex_count; ++v) {
        EXPECT_EQ(scene.materials.pinned[static_cast<std::size_t>(v)] != 0, v == first + 3 || v == first + 17);
    }
}

TEST_F(SceneFile, HashReportsContentAndNothingElse) {
    const std::uint64_t hash = read(example()).hash;
    EXPECT_EQ(read(example()).hash, hash);
    Json renamed = example();
    renamed["name"] = "another";
    renamed["description"] = "words";
    EXPECT_EQ(read(renamed).hash, hash);
    const std::vector<std::pair<const char*, Json>> changes{{"/dt", 0.002},
                                                            {"/ticks", 501},
                                                            {"/seed", 2},
                                                            {"/contact/0/k", 101},
                                                            {"/contact/0/mu", 3},
                                                            {"/bodies/0/tissue/preload", 0.21},
                                                            {"/bodies/0/tissue/drag", 6},
                                                            {"/bodies/0/tissue/strain_limit", 0.9},
                                                            {"/bodies/0/tissue/substeps", 9},
                                                            {"/bodies/0/tissue/pinned", "none"},
                                                            {"/bodies/0/side", "back"},
                                                            {"/bodies/0/pose", {0, 0, 1e-9, 0, 0, 0}},
                                                            {"/bodies/1/trocar/2", 0.21},
                                                            {"/bodies/1/tip", {0, 0, 0.001}},
                                                            {"/bodies/1/closed", false},
                                                            {"/bodies/1/motion/keys/1/pose/5", 1},
                                                            {"/bodies/1/motion/keys/1/time", 0.6},
                                                            {"/bodies/1/motion/drive", "operator"}};
    std::set<std::uint64_t> seen{hash};
    for (const auto& [pointer, value] : changes) {
        Json document = example();
        document[Pointer(pointer)] = value;
        EXPECT_TRUE(seen.insert(read(document).hash).second) << pointer;
    }
}

TEST_F(SceneFile, CoarseTissueKeepsFourSubstepsAndFineTissueGetsMore) {
    EXPECT_EQ(read(example()).materials.substeps, 4);
    Json fine = example();
    fine[Pointer("/bodies/0/parts/0/size")] = {0.02, 0.02};
    fine[Pointer("/bodies/0/parts/0/edge")] = 0.001;
    const Scene scene = read(fine);
    // METHODS §4 with L = 1 mm: m = 2.75 mg, 2 Σ k/m = 4.3e8, 2 Σ c/m = 8.7e4: step 32 µs.
    EXPECT_GT(scene.materials.substeps, 30);
    fine[Pointer("/bodies/0/tissue/substeps")] = 5;
    EXPECT_EQ(read(fine).materials.substeps, 5);
}

TEST_F(SceneFile, ABulkModulusNeedsAClosedSurfaceThatIsSaidToBeOne) {
    Json document = example();
    Json& sheet = document["bodies"][0];
    sheet["closed"] = true;
    sheet["parts"] = Json::parse(R"([{"shape":"sphere","radius":0.03,"edge":0.01}])");
    sheet["tissue"] = Json::parse(R"({"pinned":"none","bulk_modulus":1000})");
    const Scene scene = read(document);
    ASSERT_EQ(scene.materials.enclosures.size(), 1U);
    const Enclosure& enclosure = scene.materials.enclosures.front();
    EXPECT_EQ(enclosure.bulk_modulus, 1000.0);
    EXPECT_EQ(enclosure.triangles.cols(), scene.topology.bodies[1].triangles.count);
    EXPECT_TRUE(scene.topology.bodies[1].vertices.contains(enclosure.triangles.minCoeff()));
    sheet["tissue"]["bulk_modulus"] = 2000;
    EXPECT_NE(read(document).hash, scene.hash);
    sheet["closed"] = false;
    EXPECT_EQ(complaint_about(document.dump()),
              "/bodies/0/tissue/bulk_modulus: expected 0, since the body is said to be open, got 2000");
    sheet["tissue"]["bulk_modulus"] = 0;
    EXPECT_TRUE(read(document).materials.enclosures.empty());
}

struct BadValue {
    const char* pointer;
    Json value;
    const char* complaint;  ///< regular expression for the text after the file name
};

TEST_F(SceneFile, BadValuesAreNamedWithPointerExpectationAndFinding) {
    const std::vector<BadValue> cases{
        {"/format", "trocar-scene-1", "/format: expected trocar-scene-2, got \"trocar-scene-1\""},
        {"/name", 3, "/name: expected a text, got 3"},
        {"/unit", "inch", "/unit: expected one of m, mm, cm, got \"inch\""},
        {"/dt", 0, "/dt: expected a number > 0, got 0"},
        {"/dt", -0.001, "/dt: expected a number > 0, got -0.001"},
        {"/dt", "fast", "/dt: expected a number > 0, got \"fast\""},
        {"/ticks", 0, "/ticks: expected an integer from 1 to 1000000000, got 0"},
        {"/ticks", 1.5, "/ticks: expected an integer.*, got 1.5"},
        {"/seed", -1, "/seed: expected an integer >= 0, got -1"},
        {"/bodies", Json::array(), "/bodies: expected at least one body, got \\[\\]"},
        {"/bodies", 7, "/bodies: expected a list, got 7"},
        {"/ticksy", 7, "/ticksy: expected one of format, .*, got 'ticksy'"},
        {"/bodies/0/kind", "fluid", "/bodies/0/kind: expected one of instrument, rigid, tissue, got \"fluid\""},
        {"/bodies/0/closed", "no", "/bodies/0/closed: expected true or false, got \"no\""},
        {"/bodies/0/closed", true, "/bodies/0/closed: expected false, since a part is an open sheet, got true"},
        {"/bodies/0/name", "tool", "/bodies/1/name: expected a name of its own, got \"tool\""},
        {"/bodies/0/parts", Json::array(), "/bodies/0/parts: expected at least one part, got \\[\\]"},
        {"/bodies/0/parts/0/sice", 1,
         "/bodies/0/parts/0/sice: expected one of shape, size, edge, scale, pose, jaw, got 'sice'"},
        {"/bodies/0/parts/0/shape", "cube", "/bodies/0/parts/0/shape: expected one of sheet, disc, .*, got \"cube\""},
        {"/bodies/0/parts/0/edge", 0, "/bodies/0/parts/0/edge: expected a number > 0, got 0"},
        {"/bodies/0/parts/0/edge", 1e-9,
         "/bodies/0/parts/0/edge: expected an edge that gives at most 2000000 triangles \\(--large lifts this\\), got "
         "1e-09"},
        {"/bodies/0/parts/0/size", Json::array({1}),
         "/bodies/0/parts/0/size: expected a list of 2 lengths, got \\[1\\]"},
        {"/bodies/0/parts/0/scale", -1, "/bodies/0/parts/0/scale: expected a number > 0, got -1"},
        {"/bodies/0/parts/0/pose", Json::array({0, 0, 0}),
         "/bodies/0/parts/0/pose: expected a list of 6 numbers, got \\[0,0,0\\]"},
        {"/bodies/0/tissue/youngs_modulus", -38000,
         "/bodies/0/tissue/youngs_modulus: expected a number > 0, got -38000"},
        {"/bodies/1/hinge", Json::parse(R"({"axis":[0,0,0]})"),
         "/bodies/1/hinge/axis: expected a direction, got \\[0,0,0\\]"},
        {"/bodies/0/tissue/damping", -1, "/bodies/0/tissue/damping: expected a number >= 0, got -1"},
        {"/bodies/0/tissue/drag", -1, "/bodies/0/tissue/drag: expected a number >= 0, got -1"},
        {"/bodies/0/tissue/preload", "soft", "/bodies/0/tissue/preload: expected a number >= 0, got \"soft\""},
        {"/bodies/0/tissue/preload", Json::array(), "/bodies/0/tissue/preload: expected a number >= 0, got \\[\\]"},
        {"/bodies/0/tissue/bulk_modulus", -5, "/bodies/0/tissue/bulk_modulus: expected a number >= 0, got -5"},
        {"/bodies/0/tissue/bulk_modulus", 1000,
         "/bodies/0/tissue/bulk_modulus: expected 0, since the body is open, got 1000 on a surface with \\d+ open "
         "edges"},
        {"/bodies/0/tissue/stiffnes", 1,
         "/bodies/0/tissue/stiffnes: expected one of .*youngs_modulus.*, got 'stiffnes'"},
        {"/bodies/0/tissue/pinned", "edge", "/bodies/0/tissue/pinned: expected one of rim, none, got \"edge\""},
        {"/bodies/0/tissue/pinned", 3,
         "/bodies/0/tissue/pinned: expected rim, none or a list of vertex numbers, got 3"},
        {"/bodies/0/tissue/pinned", Json::array({99999}),
         "/bodies/0/tissue/pinned/0: expected an integer from 0 to \\d+, got 99999"},
        {"/bodies/0/tissue/substeps", 0, "/bodies/0/tissue/substeps: expected an integer from 1 to 1000, got 0"},
        {"/bodies/0/motion", Json::object(),
         "/bodies/0/motion: expected 'motion' at an instrument only, got one at a tissue body"},
        {"/bodies/1/tissue", Json::object(),
         "/bodies/1/tissue: expected 'tissue' at a tissue body only, got one at a instrument body"},
        {"/bodies/1/side", "front", "/bodies/1/side: expected 'side' at an open body only, got one at a closed body"},
        {"/bodies/1/pose", Json::array({0, 0, 0, 0, 0, 0}),
         "/bodies/1/pose: expected no pose beside a motion.*, got one"},
        {"/bodies/1/trocar", Json::array({0, 0}), "/bodies/1/trocar: expected a list of 3 numbers, got \\[0,0\\]"},
        {"/bodies/1/motion/drive", "magnet",
         "/bodies/1/motion/drive: expected one of prescribed, operator, got \"magnet\""},
        {"/bodies/1/motion/keys", Json::array(), "/bodies/1/motion/keys: expected at least one key, got \\[\\]"},
        {"/bodies/1/motion/keys/1/time", 0, "/bodies/1/motion/keys/1/time: expected a time after 0, got 0"},
        {"/bodies/1/motion/keys/1/jaw", 2, "/bodies/1/motion/keys/1/jaw: expected a number from 0 to 1, got 2"},
        {"/bodies/1/motion/operator", Json::object(), "/bodies/1/motion/operator: expected no operator.*, got one"},
        {"/bodies/1/parts/0/length", 0.003, "/bodies/1/parts/0/length: expected more than the radius, got 0.003"},
        {"/bodies/1/parts/0/tip", "sharp", "/bodies/1/parts/0/tip: expected one of round, flat, got \"sharp\""},
        {"/bodies/1/parts/0/jaw", "upper", "/bodies/1/parts/0/jaw: expected one of left, right, got \"upper\""},
        {"/contact/0/k", -100, "/contact/0/k: expected a number >= 0, got -100"},
        {"/contact/0/bodies/1", "shet", "/contact/0/bodies/1: expected one of tool, sheet, got \"shet\""},
        {"/contact/0/bodies", Json::array({"tool"}),
         "/contact/0/bodies: expected two names of bodies, got \\[\"tool\"\\]"},
        {"/contact/0/bodies/1", "tool", "/contact/0/bodies: expected two bodies that are tested.*"},
        {"/contact/1", Json::parse(R"({"bodies":["sheet","tool"]})"),
         "/contact/1/bodies: expected every two bodies once.*"},
    };
    for (const BadValue& bad : cases) {
        Json document = example();
        document[Pointer(bad.pointer)] = bad.value;
        const std::string complaint = complaint_about(document.dump());
        EXPECT_TRUE(std::regex_match(complaint, std::regex(bad.complaint)))
            << bad.pointer << " = " << bad.value << "\n  said:     " << complaint << "\n  expected: " << bad.complaint;
    }
}

TEST_F(SceneFile, RetiredKeysAreReportedWithTheirReplacement) {
    Json document = example();
    document[Pointer("/bodies/1/motion/drive")] = "operator";
    document[Pointer("/bodies/1/motion/operator")] = {{"mass", 0.25}};
    ASSERT_EQ(complaint_about(document.dump()), "");
    const std::map<std::string_view, std::string> places{{"", ""},
                                                         {"bodies", "/bodies/0"},
                                                         {"contact", "/contact/0"},
                                                         {"keys", "/bodies/1/motion/keys/0"},
                                                         {"motion", "/bodies/1/motion"},
                                                         {"operator", "/bodies/1/motion/operator"},
                                                         {"parts", "/bodies/0/parts/0"},
                                                         {"tissue", "/bodies/0/tissue"}};
    for (const RetiredName& row : retired_names()) {
        if (row.kind != NameKind::scene_key) continue;
        const std::string place = fmt::format("{}/{}", places.at(row.scope), row.name);
        Json old = document;
        old[Pointer(place)] = 1;
        const std::string complaint = complaint_about(old.dump());
        EXPECT_EQ(complaint.rfind(place + ": expected one of ", 0), 0U) << complaint;
        EXPECT_TRUE(complaint.ends_with(fmt::format(", got '{}': {}", row.name, row.use))) << complaint;
    }
    document[Pointer("/bodies/0/hand_damping")] = 1;
    EXPECT_TRUE(complaint_about(document.dump()).ends_with(", got 'hand_damping'")) << "retired in 'operator' alone";
}

TEST_F(SceneFile, MissingKeysAreNamed) {
    for (const char* pointer :
         {"/format", "/name", "/ticks", "/bodies", "/bodies/0/name", "/bodies/0/kind", "/bodies/0/parts",
          "/bodies/0/parts/0/size", "/bodies/0/parts/0/edge", "/bodies/1/motion/drive", "/bodies/1/motion/keys",
          "/bodies/1/motion/keys/0/time", "/bodies/1/motion/keys/0/pose", "/contact/0/bodies"}) {
        Json document = example();
        const Pointer where(pointer);
        document[where.parent_pointer()].erase(where.back());
        const std::string complaint = complaint_about(document.dump());
        const std::string parent = where.parent_pointer().to_string();
        EXPECT_EQ(complaint, (parent.empty() ? "/" : parent) + ": expected the key '" + where.back() + "', got none");
    }
}

TEST_F(SceneFile, SyntaxErrorsHaveLineAndColumn) {
    EXPECT_EQ(complaint_about("{\"format\": \"trocar-scene-2\",\n  \"dt\": 0.001,,}").substr(0, 17),
              "line 2, column 15");
    EXPECT_NE(complaint_about("").find("the end of the file"), std::string::npos);
    EXPECT_NE(complaint_about("{\"dt\": 1").find("the end of the file"), std::string::npos);
    EXPECT_NE(complaint_about("{\"dt\": NaN}").find("line 1, column"), std::string::npos);
    EXPECT_EQ(complaint_about("{\"dt\": 1e999}"),
              "/dt: expected a number that a double can hold, got one beyond 1.8e308");
    for (const char* text :
         {R"({"a":[1,{"x":[[],2]},{"y":[0,[3,-1e400]]}]})", R"({"b":{},"a":[0,[],{"z":1,"y":[{},[1,1e400]]}]})"}) {
        EXPECT_EQ(complaint_about(text).substr(0, 12), "/a/2/y/1/1: ") << text;
    }
    EXPECT_EQ(complaint_about("{\"dt\": 1, \"dt\": 2}"),
              "expected every key once in an object, got the key 'dt' twice");
}

TEST_F(SceneFile, MissingMeshAndMissingDataAreReported) {
    Json document = example();
    document[Pointer("/bodies/1/parts/0")] = {{"mesh", "shaft.stl"}};
    EXPECT_EQ(complaint_about(document.dump()).substr(0, 66),
              "/bodies/1/parts/0/mesh: expected a mesh file beside the scene, got");
    const std::filesystem::path file = folder.path() / "scene.json";
    EXPECT_FALSE(lacks_data(file, std::nullopt));
    document[Pointer("/bodies/1/parts/0/mesh")] = "data:meshes/shaft.stl";
    EXPECT_NE(complaint_about(document.dump()).find("--data"), std::string::npos);
    EXPECT_TRUE(lacks_data(file, std::nullopt));
    EXPECT_TRUE(lacks_data(file, folder.path()));
    std::filesystem::create_directories(folder.path() / "meshes");
    std::ofstream(folder.path() / "meshes" / "shaft.stl")
        << "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
           "0\nendloop\nendfacet\nendsolid a\n";
    EXPECT_FALSE(lacks_data(file, folder.path()));
    test::expect_holds(test::complaint_of([&] { (void)read_scene(file, folder.path()); }),
                       {"/bodies/1/closed: expected false, since the body's meshes have holes (3 edges with one "
                        "triangle), got true"});
    document[Pointer("/bodies/1/closed")] = false;
    std::ofstream(file) << document;
    EXPECT_FALSE(read_scene(file, folder.path()).topology.bodies[0].closed);
}

TEST_F(SceneFile, ASeamOfVerticesStoredTwiceIsNoHole) {
    // A tetrahedron of four triangles with three vertices of their own each.
    const std::array<Vector3, 4> corner{Vector3(0, 0, 0), Vector3(0.1, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1)};
    test::Shape tetrahedron;
    for (const auto& [a, b, c] : {std::array{0U, 2U, 1U}, {0U, 1U, 3U}, {0U, 3U, 2U}, {1U, 2U, 3U}}) {
        tetrahedron.add(test::triangle(corner.at(a), corner.at(b), corner.at(c)));
    }
    write_obj(folder.path() / "shaft.obj", tetrahedron);
    Json document = example();
    document[Pointer("/bodies/1/parts/0")] = {{"mesh", "shaft.obj"}};
    EXPECT_TRUE(read(document).topology.bodies[0].closed);
}

TEST_F(SceneFile, AClosedMeshMakesAClosedBodyHoweverManyTrianglesItHas) {
    Json document = example();
    document[Pointer("/bodies/0/parts/0/edge")] = 0.02;
    document["bodies"][1].erase("closed");
    document[Pointer("/bodies/1/parts/0")] = {{"mesh", "prism.obj"}};
    for (int sides = 3; sides < 40; ++sides) {
        write_obj(folder.path() / "prism.obj", test::shaft(0.1, 0.1, sides, 1));
        EXPECT_TRUE(read(document).topology.bodies[0].closed) << sides;
    }
}

/// A plate of 100 x 100 x 6 mm, from and to these parts of its lengths.
test::Shape plate(double low = 0.0, double high = 1.0) {
    const Vector3 size(0.1, 0.1, 0.006);
    return test::box_of(low * size, (high - low) * size);
}

test::Shape turned(test::Shape shape) {
    for (auto& face : shape.triangles) std::swap(face[1], face[2]);
    return shape;
}

TEST_F(SceneFile, TissueVerticesWithoutMassAreReported) {
    // A square of two triangles; a vertex that nothing uses; and one that only a triangle without area has.
    const std::string square = "v 0 0 0\nv .05 0 0\nv .05 .05 0\nv 0 .05 0\nf 1 2 3\nf 1 3 4\n";
    Json document = example();
    document["bodies"][0]["parts"] = Json::parse(R"([{"mesh":"sheet.obj"}])");
    document[Pointer("/bodies/0/tissue/pinned")] = {0};
    std::ofstream(folder.path() / "sheet.obj") << square;
    EXPECT_TRUE(read(document).notes.empty());
    std::ofstream(folder.path() / "sheet.obj") << square << "v 1 1 1\nv .025 .025 0\nf 1 6 3\n";
    const Scene scene = read(document);
    ASSERT_EQ(scene.notes.size(), 1U);
    EXPECT_EQ(
        scene.notes[0],
        "/bodies/0/tissue: 2 of 6 vertices of sheet have no mass and stay where they are, since no triangle with an "
        "area has them (first: 4)");
}

class BoneFile : public SceneFile {
protected:
    /// The example with a bone of this shape in place of the sheet.
    Json with_bone(const test::Shape& bone) {
        write_obj(folder.path() / "bone.obj", bone);
        Json document = example();
        document["bodies"][0] = Json::parse(R"({"name":"bone","kind":"rigid","parts":[{"mesh":"bone.obj"}]})");
        document["contact"][0]["bodies"][1] = "bone";
        return document;
    }
    std::string complaint_about_bone(const test::Shape& bone) { return complaint_about(with_bone(bone).dump()); }
};

TEST_F(BoneFile, AClosedMeshInTheRightOrderIsTakenAsItIs) {
    const Scene scene = read(with_bone(plate()));
    EXPECT_TRUE(scene.topology.bodies[1].closed);
    EXPECT_TRUE(scene.notes.empty());
}

TEST_F(BoneFile, AMeshInsideOutIsRefusedWithItsVolume) {
    const std::string expected =
        "/bodies/0/parts/0/mesh: expected closed surfaces with their volume inside, triangles counter-clockwise seen "
        "from outside, got a volume of -6e-05 m³ in the 12 triangles connected with triangle 0: turn all of them round "
        "(trocar mesh FILE --mend OUT.obj), or say \"closed\": false where others are inside it";
    EXPECT_EQ(complaint_about_bone(turned(plate())), expected);
    Json document = with_bone(turned(plate()));
    document["bodies"][0]["closed"] = true;
    EXPECT_EQ(complaint_about(document.dump()), expected);
    document["bodies"][0]["closed"] = false;
    EXPECT_EQ(complaint_about(document.dump()), "");
}

TEST_F(BoneFile, OneTurnedTriangleIsRefusedByItsNumberWhateverTheBodyIs) {
    for (const std::size_t t : {std::size_t{0}, std::size_t{7}}) {
        test::Shape bone = plate();
        std::swap(bone.triangles[t][1], bone.triangles[t][2]);
        for (const char* kind : {"rigid", "tissue"}) {
            for (const bool closed : {true, false}) {
                Json document = with_bone(bone);
                document["bodies"][0]["kind"] = kind;
                document["bodies"][0]["closed"] = closed;
                const std::string complaint = complaint_about(document.dump());
                EXPECT_TRUE(std::regex_match(
                    complaint, std::regex("/bodies/0/parts/0/mesh: expected neighbouring triangles that run round the "
                                          "same way, got 3 edges where they do not, first between triangles \\d+ and "
                                          "\\d+; turn round triangle " +
                                          std::to_string(t) + " \\(trocar mesh FILE --mend OUT.obj\\)")))
                    << complaint;
            }
        }
    }
}

TEST_F(BoneFile, ACavityMayBeInsideOutAndAShellBesideMayNot) {
    EXPECT_EQ(complaint_about_bone(plate().add(turned(plate(0.2, 0.8)))), "");
    EXPECT_NE(complaint_about_bone(plate().add(turned(plate(1.2, 1.8))))
                  .find("in the 12 triangles connected with triangle 12"),
              std::string::npos);
    // The same as parts of one body.
    Json document = with_bone(plate());
    write_obj(folder.path() / "hole.obj", turned(plate(0.2, 0.8)));
    document["bodies"][0]["parts"].push_back({{"mesh", "hole.obj"}});
    EXPECT_EQ(complaint_about(document.dump()), "");
    document["bodies"][0]["parts"].erase(0);
    EXPECT_EQ(complaint_about(document.dump()).substr(0, 23), "/bodies/0/parts/0/mesh:");
}

TEST_F(BoneFile, APlateOnItsOwnBackEnclosesNothing) {
    EXPECT_NE(complaint_about_bone(plate().add(turned(plate()))).find("it encloses nothing"), std::string::npos);
}

TEST_F(BoneFile, TrianglesStoredTwiceAreTakenOnceWithANoteAndKeepTheirNumbers) {
    test::Shape bone = plate();
    bone.triangles.insert(bone.triangles.begin() + 3, {5, 7, 4});  // 2 again, turned about its middle
    const Scene scene = read(with_bone(bone));
    const Scene plain = read(with_bone(plate()));
    EXPECT_EQ(scene.topology.triangles, plain.topology.triangles);
    EXPECT_TRUE(scene.topology.bodies[1].closed);
    EXPECT_EQ(scene.bodies[1].file_triangle, (std::vector<Index>{0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
    ASSERT_EQ(scene.notes.size(), 1U);
    EXPECT_EQ(scene.notes[0],
              "/bodies/0/parts/0/mesh: 1 of 13 triangles repeat an earlier one and are left out (first: 3 is 2 again)");
    // A whole second copy with vertices of its own.
    const Scene copy = read(with_bone(plate().add(plate())));
    EXPECT_EQ(copy.topology.bodies[1].triangles.count, 12);
    EXPECT_EQ(copy.notes.size(), 1U);
    // Its vertices would be points that touch without a surface. One that no triangle of the file has stays.
    EXPECT_EQ(copy.first.position, plain.first.position);
    EXPECT_EQ(copy.bodies[1].file_vertex, plain.bodies[1].file_vertex);
    const Scene lone = read(with_bone(plate().add(plate()).add({{{0.3, 0.2, 0.1}}, {}})));
    const Index corners = plain.topology.bodies[1].vertices.count;
    ASSERT_EQ(lone.topology.bodies[1].vertices.count, corners + 1);
    EXPECT_EQ(lone.bodies[1].file_vertex.back(), 2 * corners);
    EXPECT_EQ(lone.topology.triangles, plain.topology.triangles);
    EXPECT_EQ(lone.bodies[1].local.leftCols(corners), plain.bodies[1].local);
}

TEST_F(SceneFile, BodiesOfOneInstrumentAreNotTestedAgainstEachOther) {
    Json document = example();
    document["bodies"].push_back(document["bodies"][1]);
    document[Pointer("/bodies/2/name")] = "jaw";
    EXPECT_EQ(read(document).topology.body_pairs.size(), 3U);
    document[Pointer("/bodies/1/instrument")] = "grasper";
    document[Pointer("/bodies/2/instrument")] = "grasper";
    EXPECT_EQ(read(document).topology.body_pairs.size(), 2U);
}

TEST(SceneSchema, NamesEveryKeyThatTheShippedScenesUse) {
    const Json schema = Json::parse(scene_schema());
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".json") continue;
        std::ifstream stream(entry.path());
        const Json scene = Json::parse(stream);
        for (const auto& [key, value] : scene.items()) EXPECT_TRUE(schema["properties"].contains(key)) << key;
        for (const Json& body : scene["bodies"]) {
            const Json& known = schema["$defs"]["body"]["properties"];
            for (const auto& [key, value] : body.items()) EXPECT_TRUE(known.contains(key)) << key;
            if (!body.contains("tissue")) continue;
            for (const auto& [key, value] : body["tissue"].items()) {
                EXPECT_TRUE(known["tissue"]["properties"].contains(key)) << key;
            }
        }
    }
}

}  // namespace
}  // namespace trocar
