// Readers of other groups' data: on files made by hand whose content is worked out on paper, and counts on the real
// data that a second program found.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "geometry/input_error.hpp"
#include "scene/external_frames.hpp"
#include "support/data.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Pairs = std::vector<std::array<Index, 2>>;

/// Two triangles of one sheet, and between them in the file a third one above. `height`: of its lowest corner.
std::string ply(double height) {
    return "ply\nformat ascii 1.0\nelement vertex 7\nproperty double x\nproperty double y\nproperty double z\n"
           "element face 3\nproperty list uchar int vertex_indices\nend_header\n"
           "0 0 0\n4 0 0\n0 4 0\n4 4 0\n1 1 " +
           std::to_string(height) + "\n1 2 3\n2 1 3\n3 0 1 2\n3 4 5 6\n3 2 1 3\n";
}

class ScalableCcd : public testing::Test {
protected:
    ScalableCcd() {
        for (const char* name : {"frames", "boxes", "mma_bool"}) {
            std::filesystem::create_directories(folder_.path() / name);
        }
        folder_.write("frames/10.ply", ply(1.0));
        folder_.write("frames/11.ply", ply(-1.0));
        // Vertices 0 to 6; edges by their larger vertex: 7 (1,0), 8 (2,0), 9 (2,1), 10 (3,1), 11 (3,2), 12 (5,4),
        // 13 (6,4), 14 (6,5); faces 15 to 17.
        folder_.write("boxes/10vf.json", "[[4,15],[4,17]]");
        folder_.write("mma_bool/10vf_mma_bool.json", "[true,false]");
        folder_.write("boxes/10ee.json", "[[10,12],[8,13],[7,11]]");
        folder_.write("mma_bool/10ee_mma_bool.json", "[true,false,true]");
    }
    [[nodiscard]] std::string complaint() const {
        return test::complaint_of([this] { (void)read_scalable_ccd(folder_.path()); });
    }
    test::TemporaryFolder folder_;
};

TEST_F(ScalableCcd, ComponentsAreBodiesAndTrueCandidatesBetweenThemPairs) {
    const ExternalFrames data = read_scalable_ccd(folder_.path());
    ASSERT_EQ(data.topology.body_count(), 2);
    EXPECT_EQ(data.topology.bodies[0].triangles.count, 2) << "the sheet, though the file has a triangle in between";
    EXPECT_EQ(data.topology.bodies[1].triangles.count, 1);
    ASSERT_EQ(data.frames.size(), 2U);
    EXPECT_EQ(data.frames[0].position.col(4), Vector3(1, 1, 1));
    EXPECT_EQ(data.frames[1].position.col(4), Vector3(1, 1, -1));
    EXPECT_EQ(data.frames[1].previous, data.frames[0].position);
    // Vertex 4 on face 15, the first triangle of the sheet; edge 3-1 of the second one on edge 5-4. The true candidate
    // of edges 7 and 11 lies within the sheet.
    ASSERT_TRUE(data.meeting.has_value());
    EXPECT_EQ(*data.meeting, (Pairs{{0, 2}, {1, 2}}));
}

TEST_F(ScalableCcd, BadFilesAreNamed) {
    folder_.write("mma_bool/10vf_mma_bool.json", "[true]");
    test::expect_holds(complaint(), {"10vf_mma_bool.json", "2 answers", "got 1"});
    folder_.write("mma_bool/10vf_mma_bool.json", "[true,false]");
    folder_.write("boxes/10vf.json", "[[4,18],[4,17]]");
    test::expect_holds(complaint(), {"10vf.json", "/0/1", "18"});
    folder_.write("boxes/10vf.json", "[[4,15],[4,17]]");
    std::filesystem::remove(folder_.path() / "frames/11.ply");
    test::expect_holds(complaint(), {"frames", "2 files *.ply", "got 1"});
}

/// Counted by another program after the README of the data: unique pairs of triangles of different components.
TEST(ScalableCcdData, HoldsThePairsThatASecondProgramCounts) {
    const std::vector<std::pair<std::string, std::size_t>> counted{
        {"cloth-funnel", 0}, {"armadillo-rollers", 4475}, {"n-body-simulation", 59109}};
    for (const auto& [scene, pairs] : counted) {
        TROCAR_DATA_OR_SKIP(folder, "external/scalable_ccd/" + scene);
        EXPECT_EQ(read_scalable_ccd(folder).meeting->size(), pairs) << scene;
    }
}

constexpr const char* scenario = R"(<MODEL>
	<OBJECT id="1">
		<GRID id="1" x="0" y="0" z="0"/>
		<GRID id="2" x="1" y="0" z="0"/>
		<GRID id="3" x="0" y="1" z="0"/>
		<TRIA id="1" g1="1" g2="2" g3="3"/>
	</OBJECT>
	<OBJECT id="2">
		<GRID id="1" x="5" y="0" z="0"/>
		<GRID id="2" x="6" y="0" z="0"/>
		<GRID id="3" x="5" y="1" z="0"/>
		<TRIA id="1" g1="3" g2="2" g3="1"/>
	</OBJECT>
</MODEL>
<MOTION>
	<FRAME
		id="1"
		time="0.1"
		obj1_pos="10 20 30"
		obj2_pos="0 0 0"
		obj1_dc="0 -1 0	1 0 0	0 0 1"
		obj2_dc="1 0 0	0 1 0	0 0 1"
	/>
	<FRAME id="2" time="0.2" obj1_pos="0 0 0" obj2_pos="0 0 -2" obj1_dc="1 0 0 0 1 0 0 0 1" obj2_dc="1 0 0 0 1 0 0 0 1"/>
</MOTION>
)";

TEST(FclScenario, PlacesBothObjectsAtEveryPose) {
    const test::TemporaryFolder folder;
    const ExternalFrames data = read_fcl_scenario(folder.write("scenario.txt", scenario));
    ASSERT_EQ(data.frames.size(), 2U);
    EXPECT_FALSE(data.meeting.has_value());
    EXPECT_EQ(data.topology.triangle_count(), 2);
    // Rows of direction cosines: a quarter turn about z takes x to y.
    EXPECT_EQ(data.frames[0].position.col(1), Vector3(10, 21, 30));
    EXPECT_EQ(data.frames[0].position.col(2), Vector3(9, 20, 30));
    EXPECT_EQ(data.frames[0].position.col(4), Vector3(6, 0, 0));
    EXPECT_EQ(data.frames[1].position.col(3), Vector3(5, 0, -2));
    EXPECT_EQ(data.topology.triangles(0, 1), 5) << "g1 = 3 of the second object";
}

TEST(FclScenario, BadFilesAreNamedWithTheirLine) {
    const test::TemporaryFolder folder;
    const auto expect = [&folder](const std::string& good, const std::string& bad,
                                  std::initializer_list<std::string_view> parts) {
        std::string text = scenario;
        text.replace(text.find(good), good.size(), bad);
        const std::filesystem::path file = folder.write("scenario.txt", text);
        test::expect_holds(test::complaint_of([&file] { (void)read_fcl_scenario(file); }), parts);
    };
    expect(R"(<GRID id="2" x="1")", R"(<GRID id="3" x="1")", {"line 4", "from 1 to 2", "'3'"});
    expect(R"(g3="3"/>)", R"(g3="4"/>)", {"line 6", "from 1 to 3 as g3", "'4'"});
    expect(R"(x="5" y="0")", R"(x="five" y="0")", {"line 9", "a number", "'five'"});
    expect("10 20 30", "10 20", {"line 16", "a number"});
    expect("10 20 30", "10 20 30 40", {"line 16", "3 numbers in obj1_pos"});
    expect("<OBJECT id=\"2\">", "", {"line 9", "id 4, in order"});
}

TEST(CcdQueries, FourPointsBecomeTwoTriangles) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directories(folder.path() / "vertex-face");
    std::filesystem::create_directories(folder.path() / "edge-edge");
    const std::string text =
        "0,1,1,2,0,1,1\n1,1,0,1,0,1,1\n0,1,0,1,-3,2,1\n2,1,0,1,0,1,1\n"
        "0,1,-1,2,0,1,1\n1,1,0,1,0,1,1\n0,1,0,1,-3,2,1\n2,1,0,1,147573952589676412928,73786976294838206464,1\n";
    const std::vector<ContinuousQuery> face = read_ccd_queries(folder.write("vertex-face/a.csv", text));
    ASSERT_EQ(face.size(), 1U);
    EXPECT_TRUE(face[0].collides);
    EXPECT_EQ(face[0].start.topology.bodies[0].vertices.count, 1);
    EXPECT_EQ(face[0].start.topology.bodies[1].vertices.count, 3);
    EXPECT_EQ(face[0].start.frame.position.col(0), Vector3(0, 0.5, 0));
    EXPECT_EQ(face[0].start.frame.position.col(2), Vector3(0, 0, -1.5));
    EXPECT_EQ(face[0].end.position.col(3), Vector3(2, 0, 2)) << "numerators of 67 bits: 2^67 / 2^66";
    EXPECT_EQ(face[0].end.previous, face[0].start.frame.position);
    const std::vector<ContinuousQuery> edge = read_ccd_queries(folder.write("edge-edge/a.csv", text));
    ASSERT_EQ(edge.size(), 1U);
    EXPECT_EQ(edge[0].start.topology.bodies[0].vertices.count, 2);
    EXPECT_EQ(edge[0].start.topology.bodies[1].vertices.count, 2);
}

TEST(CcdQueries, BadFilesAreNamedWithTheirLine) {
    const test::TemporaryFolder folder;
    const auto expect = [&folder](const std::string& text, std::initializer_list<std::string_view> parts) {
        const std::filesystem::path file = folder.write("queries.csv", text);
        test::expect_holds(test::complaint_of([&file] { (void)read_ccd_queries(file); }), parts);
    };
    expect("0,1,1,2,0,1\n", {"line 1", "7 numbers", "got 6"});
    expect("0,1,1,0,0,1,1\n", {"line 1", "finite quotients"});
    expect("0,1,1,1,0,1,2\n", {"line 1", "0 or 1"});
    expect("0,1,1,1,0,1,1\n", {"8 rows", "1 left over"});
}

}  // namespace
}  // namespace trocar
