// Stored references: none is missing or stale, files come back as they were written, and errors against one are those
// of closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>

#include "geometry/input_error.hpp"
#include "reference/reference.hpp"
#include "simulate/overrides.hpp"
#include "study/study.hpp"
#include "support/program.hpp"
#include "support/shipped_scenes.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

void expect_unknown(const ReferenceErrors::Law& law) {
    for (const double value :
         {law.force_rms, law.force_worst, law.impulse_worst, law.position_rms, law.position_worst, law.force_bound}) {
        EXPECT_TRUE(std::isnan(value));
    }
}

using test::data_folder;
using test::scene_folder;

class StoredReference : public testing::TestWithParam<std::string> {};

TEST_P(StoredReference, BelongsToItsSceneAndSaysHowGoodItIs) {
    const std::filesystem::path file = scene_folder / (GetParam() + ".json");
    ASSERT_TRUE(std::filesystem::exists(reference_file(file)))
        << "missing; make it with: trocar reference scenes/" << GetParam() << ".json";
    const Reference stored = read_reference(reference_file(file));
    EXPECT_EQ(stored.scene, GetParam());
    for (const char* key : {"commit", "command", "settings", "seed"})
        EXPECT_FALSE(stored.origin.at(key).empty()) << key;
    for (const ReferenceSolution* solution : {&stored.hard, &stored.equal_k}) {
        if (!solution->available) {
            EXPECT_FALSE(solution->reason.empty());
            continue;
        }
        EXPECT_LE(solution->residual, 1e-4);
        EXPECT_TRUE(std::isfinite(solution->force_bound));
        EXPECT_TRUE(std::isfinite(solution->position_bound));
        EXPECT_GT(solution->until, 0.0);
    }
    EXPECT_FALSE(stored.hard.available && stored.hard.worst_gap <= 0.0);
    if (lacks_data(file, data_folder())) GTEST_SKIP() << "no data: whether it is stale cannot be reported";
    const Scene scene = read_scene(file, data_folder());
    EXPECT_EQ(find_reference(scene).state, ReferenceState::present)
        << "stale; make it anew with: trocar reference scenes/" << GetParam() << ".json";
}

INSTANTIATE_TEST_SUITE_P(Scenes, StoredReference, testing::ValuesIn(test::scene_names()),
                         [](const auto& the) { return the.param; });

TEST(StoredReferences, NoneIsLeftOverFromASceneThatIsGone) {
    for (const auto& entry : std::filesystem::directory_iterator(scene_folder / "reference")) {
        const Reference stored = read_reference(entry.path());
        const std::filesystem::path scene = scene_folder / (stored.scene + ".json");
        EXPECT_TRUE(std::filesystem::exists(scene)) << entry.path();
        EXPECT_EQ(reference_file(scene, stored.turned_k), entry.path());
    }
}

TEST(StoredReferences, EveryStiffnessThatAStudyTurnsHasOne) {
    std::set<std::pair<std::string, std::string>> points;
    for (const auto& entry : std::filesystem::directory_iterator(scene_folder.parent_path() / "bench/studies")) {
        if (entry.path().extension() != ".json") continue;
        for (const PlannedRun& run : make_plan(read_study(entry.path()))) {
            if (run.spec.knob == "k") points.emplace(run.spec.scene, run.spec.overrides);
        }
    }
    EXPECT_FALSE(points.empty());
    for (const auto& [name, overrides] : points) {
        Scene scene = read_scene(scene_folder / (name + ".json"), std::nullopt);
        apply_overrides(overrides, scene);
        const FoundReference found = find_reference(scene);
        EXPECT_EQ(found.state, ReferenceState::present) << name << " " << overrides << ": " << found.message();
    }
}

/// The stored references for other contact stiffnesses than the scenes' own, by file name.
std::vector<std::string> turned_names() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scene_folder / "reference")) {
        const std::string name = entry.path().stem().string();
        if (name.find(".k=") != std::string::npos) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
}

TEST(StoredReferences, ThoseOfATurnedStiffnessBelongToTheirSceneAndSayHowGoodTheyAre) {
    for (const std::string& name : turned_names()) {
        SCOPED_TRACE(name);
        const Reference stored = read_reference(scene_folder / "reference" / (name + ".json"));
        EXPECT_EQ(stored.origin.at("dirty"), "no");
        EXPECT_EQ(stored.origin.at("command"),
                  fmt::format("trocar reference {}.json --k {}", stored.scene, stored.turned_k));
        EXPECT_FALSE(stored.hard.available);
        EXPECT_TRUE(stored.equal_k.available
                        ? std::isfinite(stored.equal_k.force_bound) && stored.equal_k.residual <= 1e-4
                        : !stored.equal_k.reason.empty());
        const std::filesystem::path file = scene_folder / (stored.scene + ".json");
        if (lacks_data(file, data_folder())) continue;
        Scene scene = read_scene(file, data_folder());
        apply_overrides(fmt::format("k={}", stored.turned_k), scene);
        EXPECT_EQ(find_reference(scene).state, ReferenceState::present)
            << "make it anew with: " << stored.origin.at("command");
    }
}

/// 0.2 s of a force that grows by 2 N/s along z and one point that moves by 0.1 m/s along x.
Reference ramp() {
    Reference reference;
    reference.scene = "ramp";
    reference.origin["seed"] = "1";
    ReferenceSolution& hard = reference.hard;
    hard.available = true;
    hard.clears_within_strain_limit = false;
    hard.until = 0.2;
    hard.sample_interval = 0.1;
    hard.position_interval = 0.1;
    hard.force_bound = 0.001;
    hard.points = {1};
    hard.force.resize(3, 3);
    hard.force << 0, 0, 0, 0, 0, 0, 0, 0.2, 0.4;
    for (int i = 0; i < 3; ++i) hard.positions.push_back(Vector3(0.01 * i, 0, 0));
    reference.equal_k.reason = "for a test";
    return reference;
}

TEST(StoredReference, ComesBackFromItsFileAndComplainsAboutABrokenOne) {
    const test::TemporaryFolder temporary;
    const std::filesystem::path place = temporary.write("reference.json", to_json(ramp()));
    const Reference back = read_reference(place);
    EXPECT_EQ(back.hard.force, ramp().hard.force);
    EXPECT_EQ(back.hard.points, ramp().hard.points);
    ASSERT_EQ(back.hard.positions.size(), 3U);
    EXPECT_NEAR(back.hard.positions[2](0, 0), 0.02, 1e-12);
    EXPECT_TRUE(std::isnan(back.hard.order_time_step));
    EXPECT_FALSE(back.equal_k.available);
    EXPECT_EQ(back.equal_k.reason, "for a test");
    std::string text = to_json(ramp());
    text.replace(text.find("\"available\":true"), 16, "\"available\":3");
    temporary.write("reference.json", text);
    test::expect_holds(test::complaint_of([&] { read_reference(place); }), {"/hard/available"});
    temporary.write("reference.json", "{");
    EXPECT_THROW(read_reference(place), InputError);
}

FoundReference found_ramp() { return {.state = ReferenceState::present, .reference = ramp()}; }

TEST(ReferenceComparison, AConstantErrorIsReportedAsItIs) {
    const FoundReference found = found_ramp();
    ReferenceComparison comparison(found, 0.001);
    Matrix3X position = Matrix3X::Zero(3, 2);
    for (int tick = 0; tick < 200; ++tick) {
        const double time = 0.001 * tick;
        position.col(1) = Vector3(0.1 * (time + 0.001), 0.002, 0);
        comparison.observe(time, Vector3(0.3, 0, 2.0 * time - 0.4), position);
    }
    const ReferenceErrors errors = comparison.errors();
    EXPECT_NEAR(errors.hard.force_rms, 0.5, 1e-12);
    EXPECT_NEAR(errors.hard.force_worst, 0.5, 1e-12);
    EXPECT_NEAR(errors.hard.impulse_worst, 0.5 * 0.01, 1e-12);
    EXPECT_NEAR(errors.hard.position_rms, 0.002, 1e-12);
    EXPECT_NEAR(errors.hard.position_worst, 0.002, 1e-12);
    EXPECT_EQ(errors.hard.force_bound, 0.001);
    expect_unknown(errors.equal_k);
}

TEST(ReferenceComparison, SilentAfterTheEndOfTheReferenceAndWithoutOne) {
    const FoundReference found = found_ramp();
    ReferenceComparison comparison(found, 0.001);
    const Matrix3X position = Matrix3X::Zero(3, 2);
    comparison.observe(0.0, Vector3::Zero(), position);
    comparison.observe(0.3, Vector3(100, 0, 0), position);
    EXPECT_NEAR(comparison.errors().hard.force_worst, 0.0, 1e-12);
    const FoundReference nothing;
    ReferenceComparison none(nothing, 0.001);
    none.observe(0.0, Vector3(1, 0, 0), position);
    expect_unknown(none.errors().equal_k);
    expect_unknown(none.errors().hard);
    EXPECT_TRUE(std::isnan(none.errors().hard_clears));
}

TEST(LowPass, KeepsSlowTakesFastAndDelaysNothing) {
    const auto through = [](double frequency) {
        std::vector<Vector3> samples;
        for (int i = 0; i < 2000; ++i) {
            samples.emplace_back(std::sin(2.0 * std::numbers::pi * frequency * 0.001 * i), 0, 0);
        }
        const auto filtered = low_pass(samples, 0.001, 30.0);
        double worst = 0.0;
        double largest = 0.0;
        for (std::size_t i = 500; i < 1500; ++i) {
            worst = std::max(worst, (filtered[i] - samples[i]).norm());
            largest = std::max(largest, filtered[i].norm());
        }
        return std::pair(worst, largest);
    };
    // Twice a second-order Butterworth: 1 / (1 + (f / fc)^4), without phase.
    EXPECT_LT(through(3.0).first, 2e-4);
    EXPECT_NEAR(through(30.0).second, 0.5, 0.01);
    EXPECT_NEAR(through(90.0).second, 1.0 / 82.0, 0.003);
    EXPECT_LT(through(300.0).second, 1e-3);
}

TEST(StoredReferences, AFileOfAnotherFormatIsNamedAndNoRunEndsOfIt) {
    const test::TemporaryFolder temporary;
    std::filesystem::create_directories(temporary.path() / "reference");
    const std::filesystem::path copy = temporary.path() / "i2t_poke.json";
    std::filesystem::copy_file(scene_folder / "i2t_poke.json", copy);
    std::ofstream(reference_file(copy)) << R"({"format": "trocar-reference-0"})";
    const FoundReference found = find_reference(read_scene(copy, std::nullopt));
    EXPECT_EQ(found.state, ReferenceState::stale);
    EXPECT_FALSE(found.reference.hard.available || found.reference.equal_k.available);
    const std::string message = found.message();
    EXPECT_NE(message.find("no reference (the stored one cannot be read"), std::string::npos) << message;
    EXPECT_NE(message.find("trocar-reference-0"), std::string::npos) << message;
}

TEST(StoredReferences, TheirHashChangesWithEveryFileOfTheSceneAndNoOther) {
    const test::TemporaryFolder temporary;
    const std::filesystem::path scene = temporary.path() / "poke.json";
    EXPECT_EQ(hash_of_references(scene), "");
    std::filesystem::create_directories(temporary.path() / "reference");
    EXPECT_EQ(hash_of_references(scene), "");
    std::set<std::string> seen{""};
    const auto is_new = [&] { return seen.insert(hash_of_references(scene)).second; };
    for (const double k : {std::nan(""), 400.0}) {
        for (const char* content : {"one", "two"}) {
            std::ofstream(reference_file(scene, k)) << content;
            EXPECT_TRUE(is_new()) << k << content;
        }
    }
    std::ofstream(reference_file(temporary.path() / "poke_2.json")) << "another scene's";
    EXPECT_FALSE(is_new());
    std::ofstream(reference_file(scene, 400.0).string() + ".part") << "half a file";
    EXPECT_FALSE(is_new());
    std::filesystem::remove(reference_file(scene));
    EXPECT_TRUE(is_new());
}

TEST(StoredReferences, ATurnedStiffnessHasItsOwnEqualKAndTheSceneHardContact) {
    const test::TemporaryFolder temporary;
    std::filesystem::create_directories(temporary.path() / "reference");
    const std::filesystem::path file = temporary.path() / "i2t_poke.json";
    std::filesystem::copy_file(scene_folder / "i2t_poke.json", file);
    const Scene own = read_scene(file, std::nullopt);
    const auto at_k = [&](double k) {
        Scene scene = own;
        apply_overrides(fmt::format("k={}", k), scene);
        return scene;
    };
    const auto store = [&](Reference reference, double turned_k, double reported_k, const std::string& hash) {
        reference.scene_hash = hash;
        reference.turned_k = reported_k;
        std::ofstream(reference_file(file, turned_k)) << to_json(reference);
    };
    const std::string hash = fmt::format("{:016x}", own.hash);
    Reference whole = ramp();
    whole.equal_k = whole.hard;
    whole.equal_k.force *= 2.0;
    Reference turned = ramp();
    turned.equal_k = turned.hard;
    turned.equal_k.force *= 3.0;
    turned.hard = {};
    store(whole, std::nan(""), std::nan(""), hash);
    store(turned, 400.0, 400.0, hash);
    // The same stiffness as the scene's own is no other: the scene's own file answers.
    EXPECT_TRUE(std::filesystem::exists(temporary.path() / "reference" / "i2t_poke.k=400.json"));
    EXPECT_NEAR(find_reference(at_k(100.0)).reference.equal_k.force_at(0.2).z(), 0.8, 1e-12);
    const FoundReference at_400 = find_reference(at_k(400.0));
    EXPECT_EQ(at_400.state, ReferenceState::present);
    EXPECT_NEAR(at_400.reference.equal_k.force_at(0.2).z(), 1.2, 1e-12);
    EXPECT_NEAR(at_400.reference.hard.force_at(0.2).z(), 0.4, 1e-12);

    const auto lacks_equal_k_alone = [](const FoundReference& found, ReferenceState state, const char* reason) {
        EXPECT_EQ(found.state, state);
        EXPECT_FALSE(found.reference.equal_k.available);
        EXPECT_NE(found.reference.equal_k.reason.find(reason), std::string::npos) << found.reference.equal_k.reason;
        EXPECT_NEAR(found.reference.hard.force_at(0.2).z(), 0.4, 1e-12);
        expect_unknown(ReferenceComparison(found, 0.001).errors().equal_k);
    };
    lacks_equal_k_alone(find_reference(at_k(25.0)), ReferenceState::missing, "none is stored for k = 25 N/m");
    store(turned, 25.0, 25.0, "0000000000000001");
    lacks_equal_k_alone(find_reference(at_k(25.0)), ReferenceState::stale, "another state of the scene");
    store(turned, 25.0, 400.0, hash);
    lacks_equal_k_alone(find_reference(at_k(25.0)), ReferenceState::stale, "another k");
    store(turned, std::nan(""), std::nan(""), "0000000000000001");
    EXPECT_FALSE(find_reference(at_k(400.0)).reference.hard.available) << "the scene's own is stale";
    EXPECT_TRUE(find_reference(at_k(400.0)).reference.equal_k.available);
}

}  // namespace
}  // namespace trocar
