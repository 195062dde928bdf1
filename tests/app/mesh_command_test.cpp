// The command as others drive it: keys of the JSON document, exit status, one line per error.
#include <gtest/gtest.h>

#include "support/commands.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::ProgramResult;
using test::run_program;
using Json = nlohmann::ordered_json;

class MeshCommand : public testing::Test {
protected:
    std::string words(const std::string& name, const std::string& text, const std::string& options = "") {
        return "mesh " + folder_.write(name, text).string() + " " + options;
    }
    ProgramResult run(const std::string& name, const std::string& text, const std::string& options = "") {
        return run_program(words(name, text, options));
    }
    test::TemporaryFolder folder_;
};

const std::string tetrahedron = "OFF\n5 4 0\n0 0 0\n2 0 0\n0 2 0\n0 0 2\n9 9 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";

TEST_F(MeshCommand, JsonHoldsExactlyTheAgreedKeys) {
    const ProgramResult result = run("t.off", tetrahedron, "--json");
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.err, "");
    const Json expected = Json::parse(R"({"format":"off","vertices_stored":5,"vertices":4,"triangles":4,"shells":1,
        "boundary_edges":0,"holes":0,"non_manifold_edges":0,"flipped_edges":0,"bow_vertices":0,
        "degenerate_triangles":0,"duplicate_triangles":0,"self_intersections":0,"watertight":true,
        "signed_volume":1.3333333333333333,"box":[[0.0,0.0,0.0],[2.0,2.0,2.0]],"unit":{"name":"m","guessed":true}})");
    EXPECT_EQ(Json::parse(result.out), expected);
}

TEST_F(MeshCommand, CoincidentLayersAreReportedBesideSelfIntersections) {
    const std::string layers = "OFF\n6 2 0\n0 0 0\n2 0 0\n0 2 0\n.5 .5 0\n3 .5 0\n.5 3 0\n3 0 1 2\n3 3 4 5\n";
    const Json json = Json::parse(run("layers.off", layers, "--json").out);
    EXPECT_EQ(json.at("coplanar_overlaps"), 1);
    EXPECT_EQ(json.at("self_intersections"), 0);
    test::expect_holds(run("layers.off", layers).out, {"coincident layers      1 "});
}

TEST_F(MeshCommand, WhatASceneWouldRefuseIsReportedWithTheTrianglesToMend) {
    std::string turned = tetrahedron;
    turned.replace(turned.find("3 0 1 3"), 7, "3 0 3 1");
    const Json one = Json::parse(run("t.off", turned, "--json").out);
    EXPECT_EQ(one.at("turned_triangles"), Json::parse("[1]"));
    EXPECT_FALSE(one.contains("inside_out"));
    EXPECT_NE(run("t.off", turned).out.find("triangles 1 "), std::string::npos);
    const Json all = Json::parse(
        run("t.off", "OFF\n4 4 0\n0 0 0\n2 0 0\n0 2 0\n0 0 2\n3 0 1 2\n3 0 3 1\n3 1 3 2\n3 0 2 3\n", "--json").out);
    EXPECT_EQ(all.at("inside_out"), Json::parse(R"([{"triangle":0,"triangles":4,"volume":-1.3333333333333333}])"));
}

TEST_F(MeshCommand, MendWritesAMeshThatHasNothingLeftToTurn) {
    const std::string mended = (folder_.path() / "mended.obj").string();
    std::string turned = tetrahedron;
    turned.replace(turned.find("3 0 1 3"), 7, "3 0 3 1");
    EXPECT_EQ(run("t.off", turned, "--mend " + mended).status, 0);
    const Json after = Json::parse(run_program("mesh --json " + mended).out);
    EXPECT_EQ(after.at("flipped_edges"), 0);
    EXPECT_FALSE(after.contains("turned_triangles"));
    EXPECT_DOUBLE_EQ(after.at("signed_volume").get<double>(), 4.0 / 3.0);
}

TEST_F(MeshCommand, MeshWithoutTrianglesIsDoneWithNullForWhatHasNoNumber) {
    const ProgramResult result = run("t.off", "OFF\n1 0 0\n1 2 3\n", "--json");
    EXPECT_EQ(result.status, 0);
    const Json document = Json::parse(result.out);
    EXPECT_EQ(document.at("triangles"), 0);
    EXPECT_EQ(document.at("signed_volume"), 0.0);
    EXPECT_TRUE(document.at("box")[0][0].is_null());
}

TEST_F(MeshCommand, BadFilesEndWithStatusTwoAndOneLine) {
    test::expect_refused(words("t.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "--json"),
                         "t.off: line 4: expected a vertex number 0 to 0, got '1'\n");
    EXPECT_EQ(run_program("mesh no/such/file.stl").status, 2);
    EXPECT_EQ(run_program("mesh").status, 2);
}

TEST_F(MeshCommand, SurfacesThatAreNotReadAreNamed) {
    const ProgramResult result = run("t.wrl", "#VRML V2.0 utf8\nShape { geometry Box { size 1 1 1 } }\n", "--json");
    EXPECT_EQ(result.status, 0);
    EXPECT_NE(result.err.find("line 2: Box"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace trocar
