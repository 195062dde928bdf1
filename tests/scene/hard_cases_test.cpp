// The hard cases of scenes/hard, whose answers were found by reasoning (each says how), against the exact oracle and
// every detector that claims exactness; and that every entry of the list of hard cases has a case.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/mesh_pair.hpp"
#include "scene/scene.hpp"
#include "simulate/hard_case.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar::test {
namespace {

const std::filesystem::path folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "hard";

std::vector<trocar::HardCase> mesh_cases() {
    std::vector<trocar::HardCase> cases = read_hard_cases(folder);
    std::erase_if(cases, [](const trocar::HardCase& one) { return !one.pairs; });
    return cases;
}

class HardCase : public testing::TestWithParam<trocar::HardCase> {};

TEST_P(HardCase, OracleAndExactDetectorsGiveTheReasonedAnswer) {
    const trocar::HardCase& one = GetParam();
    const std::filesystem::path place = one.file.parent_path();
    MeshPair question = make_mesh_pair(read_mesh(place / "a.obj"), read_mesh(place / "b.obj"));
    if (one.not_finite >= 0) question.frame.position(1, one.not_finite) = std::numeric_limits<double>::quiet_NaN();
    std::vector<TrianglePair> pairs;
    for (const auto& [a, b] : *one.pairs) pairs.push_back({a, b + question.topology.bodies[1].triangles.first});
    if (one.not_finite < 0) {
        std::vector<TrianglePair> truth;
        true_pairs(question.topology, question.frame, truth);
        EXPECT_EQ(truth, pairs) << "oracle";
        EXPECT_EQ(touching_pairs(question.topology, question.frame, pairs), one.touch);
    }
    for (const DetectorEntry& entry : registry().detectors()) {
        if (!entry.claims_exact) continue;
        const std::unique_ptr<Detector> detector = make_detector(entry.name);
        ContactSet contacts;
        detector->prepare(question.topology, question.frame);
        detector->update(question.frame, 0.0);
        detector->detect(question.frame, contacts);
        EXPECT_EQ(contacts.outcome.kind, one.outcome) << entry.name << ": " << contacts.outcome.message;
        EXPECT_EQ(contacts.pairs, pairs) << entry.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Folder, HardCase, testing::ValuesIn(mesh_cases()),
                         [](const auto& tested) { return tested.param.name; });

TEST(HardCases, EveryEntryOfTheListHasACase) {
    const std::set<std::string> list{"touching ± 1 ulp",
                                     "coplanar",
                                     "shared edge or vertex",
                                     "slivers",
                                     "zero area",
                                     "duplicate and opposite faces",
                                     "needle through one face",
                                     "single triangle",
                                     "contained",
                                     "concentric",
                                     "deep start",
                                     "fast stab through a thin sheet",
                                     "drag",
                                     "resting contact jitter",
                                     "grasp and pull to large strain",
                                     "stiffness ratio 1e5",
                                     "step beyond the stability limit",
                                     "inverted normals",
                                     "open and closed meshes",
                                     "non-manifold",
                                     "empty mesh",
                                     "NaN or Inf vertex",
                                     "cell-boundary and negative coordinates",
                                     "huge triangle in tiny cells",
                                     "scale 1e-6 … 1e3",
                                     "origin at 1e4",
                                     "two instruments locked",
                                     "10× step change"};
    std::set<std::string> found;
    for (const trocar::HardCase& one : read_hard_cases(folder)) found.insert(one.of);
    EXPECT_EQ(found, list);
}

TEST(HardCases, ScenesThatAreNamedExistAndAskForSomething) {
    for (const trocar::HardCase& one : read_hard_cases(folder)) {
        if (one.scene.empty()) continue;
        const Scene scene = read_scene(one.file.parent_path() / one.scene, std::nullopt);
        EXPECT_GT(scene.ticks, 0) << one.name;
        EXPECT_TRUE(!one.at_most.empty() || one.outcome != OutcomeKind::ok) << one.name << " asks for nothing";
    }
}

/// Largest force of a stored hard reference and its largest change from tick to tick, read without code of the product.
std::pair<double, double> force_and_step(const std::filesystem::path& reference, double dt) {
    const auto hard = nlohmann::json::parse(read_file(reference)).at("hard");
    const double interval = hard.at("sample_interval");
    const std::vector<std::array<double, 3>> force = hard.at("force");
    const auto at = [&](double time) {
        const auto i = std::min(static_cast<std::size_t>(time / interval + 1e-9), force.size() - 1);
        const std::size_t j = std::min(i + 1, force.size() - 1);
        const double part = time / interval - static_cast<double>(i);
        Vector3 value;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            value[static_cast<Index>(axis)] = (1.0 - part) * force[i].at(axis) + part * force[j].at(axis);
        }
        return value;
    };
    double largest = 0.0;
    double step = 0.0;
    Vector3 before = Vector3::Zero();
    for (int tick = 0; tick * dt <= hard.at("until").get<double>(); ++tick) {
        const Vector3 now = at(tick * dt);
        largest = std::max(largest, now.norm());
        step = std::max(step, (now - before).norm());
        before = now;
    }
    return {largest, step};
}

TEST(HardCases, ScenesThatStartApartAreJudgedInContactByTheirHardReference) {
    int with_reference = 0;
    for (const trocar::HardCase& one : read_hard_cases(folder)) {
        if (one.at_most.empty() || one.at_most.contains("ticks_to_clear_max")) continue;
        EXPECT_TRUE(one.at_most.contains("residual_penetration_max_m")) << one.name << " is judged at every tick";
        const std::filesystem::path file = (one.file.parent_path() / one.scene).lexically_normal();
        const std::filesystem::path reference = file.parent_path() / "reference" / (file.stem().string() + ".json");
        ASSERT_TRUE(std::filesystem::exists(reference)) << one.name << ": make it by `trocar reference`";
        if (!nlohmann::json::parse(read_file(reference)).at("hard").at("available").get<bool>()) {
            EXPECT_NE(one.reason.find("no reference"), std::string::npos) << one.name << " says why";
            continue;
        }
        ++with_reference;
        const auto [largest, step] = force_and_step(reference, read_scene(file, std::nullopt).dt);
        EXPECT_NEAR(one.at_most.at("force_error_rms_hard"), 0.25 * largest, 0.005 * largest) << one.name;
        EXPECT_NEAR(one.at_most.at("force_jump_max_n"), 0.05 + 2.0 * step, 0.005 * (0.05 + 2.0 * step)) << one.name;
    }
    EXPECT_EQ(with_reference, 6);
}

TEST(HardCases, ACaseOfNoKindOrOfBothIsBadInput) {
    const TemporaryFolder temporary;
    const std::filesystem::path file = temporary.path() / "expected.json";
    const auto complaint = [&file](const std::string& text) {
        std::ofstream(file) << text;
        return complaint_of([&] { static_cast<void>(read_hard_case(file)); });
    };
    EXPECT_NE(complaint(R"({"of":"x","reason":"y"})").find("got neither"), std::string::npos);
    EXPECT_NE(complaint(R"({"of":"x","reason":"y","pairs":[],"touch":[],"scene":"c.json"})").find("got both"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"of":"x","reason":"y","scene":"c.json","at_most":{"speed":1}})").find("/at_most/speed"),
              std::string::npos);
    EXPECT_EQ(complaint(R"({"of":"x","reason":"y","scene":"c.json","at_most":{"residual_penetration_max_m":1}})"), "");
}

}  // namespace
}  // namespace trocar::test
