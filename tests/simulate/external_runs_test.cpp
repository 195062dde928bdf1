// Detectors on external data: beginnings are counted against the answers that come with the data, pairs against the
// exact oracle.
#include <gtest/gtest.h>

#include <set>

#include "method/registry.hpp"
#include "simulate/external_runs.hpp"
#include "support/data.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

/// A sheet of one triangle, and one that falls through it from `start` to `end` (heights of its lowest corner).
ExternalFrames falling(double start, double end) {
    const auto triangle = [](std::initializer_list<Vector3> corners) {
        Mesh mesh;
        mesh.vertices.resize(3, 3);
        Eigen::Index k = 0;
        for (const Vector3& corner : corners) mesh.vertices.col(k++) = corner;
        mesh.triangles.resize(3, 1);
        mesh.triangles << 0, 1, 2;
        return mesh;
    };
    const auto pair_at = [&triangle](double height) {
        return make_mesh_pair(triangle({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}),
                              triangle({{1, 1, height}, {1, 1.5, height + 1.0}, {1.5, 1, height + 1.0}}));
    };
    MeshPair before = pair_at(start);
    MeshPair after = pair_at(end);
    after.frame.previous = before.frame.position;
    after.frame.velocity = after.frame.position - after.frame.previous;
    after.frame.tick = 1;
    ExternalFrames data;
    data.topology = std::move(before.topology);
    data.frames = {std::move(before.frame), std::move(after.frame)};
    data.meeting = {{{0, 1}}};
    return data;
}

RunSpec external_spec(const std::string& detector) {
    RunSpec spec;
    spec.mode = "external";
    spec.detector = detector;
    spec.ticks = 2;
    return spec;
}

std::vector<Record> run_on(const ExternalFrames& data, const std::vector<std::string>& detectors) {
    std::vector<RunSpec> specs;
    specs.reserve(detectors.size());
    for (const std::string& detector : detectors) specs.push_back(external_spec(detector));
    return run_external(data, specs);
}

double counted(const Record& record, Metric metric) { return record.summary.at(metric); }

TEST(ExternalRuns, ADiscreteDetectorMissesWhatIsOverAtTheSecondFrame) {
    const std::vector<Record> records = run_on(falling(1.0, -3.0), {"ohc_clustered", "ohc_clustered:swept=on"});
    ASSERT_EQ(records.size(), 2U);
    for (const Record& record : records) {
        EXPECT_TRUE(record.outcome.ok());
        EXPECT_EQ(counted(record, Metric::true_swept), 1.0);
        EXPECT_EQ(counted(record, Metric::true_pairs), 0.0);
        EXPECT_EQ(counted(record, Metric::swept_false_positives), 0.0);
        EXPECT_EQ(record.rows.size(), 2U) << "a row for each round";
    }
    EXPECT_EQ(counted(records[0], Metric::swept_false_negatives), 1.0);
    EXPECT_EQ(counted(records[1], Metric::swept_false_negatives), 0.0);
}

TEST(ExternalRuns, APairOfTheSecondFrameIsFoundByAll) {
    for (const Record& record : run_on(falling(1.0, -0.5), {"ohc_clustered", "ohc_clustered:swept=on"})) {
        EXPECT_EQ(counted(record, Metric::true_swept), 1.0);
        EXPECT_EQ(counted(record, Metric::true_pairs), 1.0);
        EXPECT_EQ(counted(record, Metric::swept_false_negatives), 0.0) << record.spec.detector;
        EXPECT_EQ(counted(record, Metric::false_negatives), 0.0) << record.spec.detector;
    }
}

TEST(ExternalRuns, APairThatMeetsAtTheFirstFrameDoesNotBegin) {
    const Record record = run_on(falling(-0.5, -3.0), {"ohc_clustered"}).front();
    EXPECT_EQ(counted(record, Metric::true_swept), 0.0);
    EXPECT_EQ(counted(record, Metric::swept_false_negatives), 0.0);
}

TEST(ExternalRuns, AnAnswerThatTheSourceDoesNotHaveIsInvented) {
    ExternalFrames data = falling(1.0, -3.0);
    data.meeting->clear();
    const Record record = run_on(data, {"ohc_clustered:swept=on"}).front();
    EXPECT_EQ(counted(record, Metric::swept_false_positives), 1.0);
}

TEST(ExternalRuns, PosesWithoutAMotionAreAllAsked) {
    ExternalFrames data = falling(1.0, -0.5);
    data.meeting.reset();
    data.frames[1].previous = data.frames[1].position;
    const Record record = run_on(data, {"brute_force"}).front();
    EXPECT_EQ(counted(record, Metric::judged_ticks), 2.0);
    EXPECT_EQ(counted(record, Metric::true_pairs), 1.0);
    EXPECT_EQ(record.rows.size(), 4U) << "two poses in two rounds";
}

TEST(ExternalRuns, AQueryIsFoundAtAFrameOrBetweenThem) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directories(folder.path() / "vertex-face");
    // The vertex falls from z = 1 to z = -1: through the face, beside it, and through it with the wrong answer.
    const auto query = [](const std::string& x, const std::string& answer) {
        const std::string face = "0,1,0,1,0,1," + answer + "\n4,1,0,1,0,1," + answer + "\n0,1,4,1,0,1," + answer + "\n";
        return x + ",1,1,1,1,1," + answer + "\n" + face + x + ",1,1,1,-1,1," + answer + "\n" + face;
    };
    const std::filesystem::path file =
        folder.write("vertex-face/a.csv", query("1", "1") + query("9", "0") + query("1", "0"));
    const Record swept = run_ccd_queries(file, external_spec("ohc:swept=on"));
    EXPECT_TRUE(swept.outcome.ok());
    EXPECT_EQ(counted(swept, Metric::judged_ticks), 3.0);
    EXPECT_EQ(counted(swept, Metric::true_pairs), 1.0);
    EXPECT_EQ(counted(swept, Metric::false_negatives), 0.0);
    EXPECT_EQ(counted(swept, Metric::false_positives), 1.0);
    const Record discrete = run_ccd_queries(file, external_spec("ohc"));
    EXPECT_EQ(counted(discrete, Metric::false_negatives), 1.0);
    EXPECT_EQ(counted(discrete, Metric::false_positives), 0.0);
}

TEST(ExternalRuns, SweptDetectorsAgreeWithTheSourceOnItsData) {
    TROCAR_DATA_OR_SKIP(folder, "external/scalable_ccd/armadillo-rollers");
    const Record record = run_on(read_scalable_ccd(folder), {"ohc_clustered:swept=on"}).front();
    EXPECT_EQ(counted(record, Metric::true_swept), 4475.0) << "none of the pairs meets at the first frame";
    EXPECT_EQ(counted(record, Metric::swept_false_negatives), 0.0);
    EXPECT_EQ(counted(record, Metric::swept_false_positives), 0.0);
}

}  // namespace
}  // namespace trocar
