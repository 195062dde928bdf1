// The hard cases of scenes/hard, whose answers were found by reasoning (each says how), against the exact oracle and
// every detector that claims exactness.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"

namespace trocar {
namespace {

const std::filesystem::path folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "hard";

std::vector<std::string> case_names() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.is_directory()) names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

class HardCase : public testing::TestWithParam<std::string> {
protected:
    [[nodiscard]] nlohmann::json expected() const {
        std::ifstream stream(folder / GetParam() / "expected.json");
        return nlohmann::json::parse(stream);
    }
    [[nodiscard]] Mesh mesh(const char* name) const { return read_mesh(folder / GetParam() / name); }
};

TEST_P(HardCase, OracleAndExactDetectorsGiveTheReasonedAnswer) {
    const nlohmann::json answer = expected();
    if (answer.contains("bad_input")) {
        const std::string place = answer["bad_input"];
        try {
            static_cast<void>(mesh("a.obj"));
            FAIL() << "no complaint";
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(place), std::string::npos) << error.what();
        }
        return;
    }
    const Mesh a = mesh("a.obj");
    const Mesh b = mesh("b.obj");
    const Topology topology =
        make_topology({{.name = "a", .vertex_count = static_cast<Index>(a.vertices.cols()), .triangles = a.triangles},
                       {.name = "b", .vertex_count = static_cast<Index>(b.vertices.cols()), .triangles = b.triangles}},
                      {{0, 1}});
    Frame frame;
    frame.position.resize(3, topology.vertex_count);
    frame.position << a.vertices, b.vertices;
    frame.previous = frame.position;
    frame.velocity = Matrix3X::Zero(3, topology.vertex_count);

    std::vector<TrianglePair> pairs;
    for (const nlohmann::json& pair : answer["pairs"]) {
        pairs.push_back({pair[0].get<Index>(), pair[1].get<Index>() + topology.bodies[1].triangles.first});
    }
    std::vector<TrianglePair> truth;
    true_pairs(topology, frame, truth);
    EXPECT_EQ(truth, pairs) << "oracle";
    EXPECT_EQ(touching_pairs(topology, frame, pairs), answer["touch"].get<std::vector<Index>>());
    for (const DetectorEntry& entry : registry().detectors()) {
        if (!entry.claims_exact) continue;
        const std::unique_ptr<Detector> detector = make_detector(entry.name);
        ContactSet contacts;
        detector->prepare(topology, frame);
        detector->update(frame);
        detector->detect(frame, contacts);
        EXPECT_TRUE(contacts.outcome.ok()) << entry.name << ": " << contacts.outcome.message;
        EXPECT_EQ(contacts.pairs, pairs) << entry.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Folder, HardCase, testing::ValuesIn(case_names()),
                         [](const auto& tested) { return tested.param; });

TEST(HardCases, AreThere) { EXPECT_GE(case_names().size(), 15U); }

}  // namespace
}  // namespace trocar
