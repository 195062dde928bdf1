#include "simulate/hard_case.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/whole_file.hpp"
#include "measure/metrics.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/json_node.hpp"
#include "scene/mesh_pair.hpp"

namespace trocar {
namespace {

Index small_number(const JsonNode& node) { return static_cast<Index>(node.integer(0, 1'000'000)); }

/// Runs a new detector on one frame. An exception becomes the outcome `threw`.
void ask(const RunSpec& spec, const MeshPair& question, bool native, ContactSet& contacts) {
    contacts.clear();
    contacts.native_wanted = native;
    const std::unique_ptr<Detector> detector = make_detector(spec.detector);
    try {
        detector->prepare(question.topology, question.frame);
        detector->update(question.frame, 0.0);
        detector->detect(question.frame, contacts);
    } catch (const std::exception& error) {
        contacts.clear();
        contacts.outcome = {OutcomeKind::threw, error.what()};
    }
}

bool is_finite(const Contact& contact) {
    return contact.point.allFinite() && contact.normal.allFinite() && std::isfinite(contact.depth);
}

}  // namespace

HardCase read_hard_case(const std::filesystem::path& file) {
    const std::string file_name = file.string();
    const Json document = parse_json(read_whole(file, "a readable file"), file_name);
    const JsonNode root(document, file_name);
    root.expect_keys({"of", "reason", "pairs", "touch", "not_finite", "scene", "at_most", "outcome", "ticks"});
    HardCase result;
    result.file = file;
    result.name = file.parent_path().filename().string();
    result.of = root.at("of").text();
    result.reason = root.at("reason").text();
    if (root.has("pairs")) {
        auto& pairs = result.pairs.emplace();
        for (const JsonNode& item : root.at("pairs").list()) {
            const std::vector<JsonNode> numbers = item.list();
            if (numbers.size() != 2) item.fail("two triangle numbers");
            pairs.push_back({small_number(numbers[0]), small_number(numbers[1])});
        }
        for (const JsonNode& item : root.at("touch").list()) result.touch.push_back(small_number(item));
    }
    if (const auto node = root.find("not_finite")) result.not_finite = small_number(*node);
    if (const auto node = root.find("scene")) result.scene = node->text();
    if (const auto node = root.find("at_most")) {
        for (const std::string& key : node->keys()) {
            if (!metric_named(key)) node->at(key).fail("a metric of `trocar schema figures`", "'" + key + "'");
            result.at_most[key] = node->at(key).number();
        }
    }
    if (const auto node = root.find("ticks")) result.ticks = node->integer(1, 1'000'000);
    if (const auto node = root.find("outcome")) result.outcome = outcome_kind_from(node->text());
    const bool is_scene = !result.scene.empty();
    if (result.pairs.has_value() == is_scene) root.fail("one of the keys pairs, scene", is_scene ? "both" : "neither");
    return result;
}

std::vector<HardCase> read_hard_cases(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    if (std::filesystem::is_directory(folder)) {
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (std::filesystem::is_regular_file(entry.path() / "expected.json")) {
                files.push_back(entry.path() / "expected.json");
            }
        }
    }
    if (files.empty()) throw InputError(folder.string(), "", "folders with expected.json", "none");
    std::sort(files.begin(), files.end());
    std::vector<HardCase> cases;
    cases.reserve(files.size());
    for (const std::filesystem::path& file : files) cases.push_back(read_hard_case(file));
    return cases;
}

std::string hash_of(const HardCase& hard_case) {
    FnvHash hash;
    for (const char* name : {"expected.json", "a.obj", "b.obj"}) {
        const std::filesystem::path file = hard_case.file.parent_path() / name;
        if (std::filesystem::exists(file)) hash.add_text(read_whole(file, "a readable file"));
    }
    return hash.text();
}

Record run_hard_case(const HardCase& hard_case, const RunSpec& spec) {
    Record record = started_record(spec);
    const std::filesystem::path folder = hard_case.file.parent_path();
    MeshPair question = make_mesh_pair(read_mesh(folder / "a.obj"), read_mesh(folder / "b.obj"));
    if (hard_case.not_finite >= 0) question.frame.position.col(hard_case.not_finite)[1] = std::nan("");
    std::vector<TrianglePair> truth;
    for (const auto& [a, b] : hard_case.pairs.value_or(std::vector<std::array<Index, 2>>{})) {
        truth.push_back({a, b + question.topology.bodies[1].triangles.first});
    }
    ContactSet contacts;
    ask(spec, question, false, contacts);
    record.outcome = contacts.outcome;
    const PairErrors errors = compare_pairs(contacts.pairs, truth, hard_case.touch);
    record.summary = {{Metric::judged_ticks, 1.0},
                      {Metric::true_pairs, static_cast<double>(truth.size())},
                      {Metric::true_touches, static_cast<double>(hard_case.touch.size())},
                      {Metric::false_negatives, static_cast<double>(errors.false_negatives)},
                      {Metric::false_negatives_touch, static_cast<double>(errors.false_negatives_touch)},
                      {Metric::false_positives, static_cast<double>(errors.false_positives)},
                      {Metric::truncated_ticks, contacts.truncated ? 1.0 : 0.0}};
    if (!record.outcome.ok() || !registry().detector(parse_method(spec.detector).name).native_contacts) return record;
    ask(spec, question, true, contacts);
    const auto bad = std::count_if(contacts.native.begin(), contacts.native.end(),
                                   [](const Contact& contact) { return !is_finite(contact); });
    if (!contacts.outcome.ok()) {
        record.outcome = contacts.outcome;
    } else if (bad > 0) {
        record.outcome = {OutcomeKind::not_finite,
                          fmt::format("{} of {} native contacts", bad, contacts.native.size())};
    }
    return record;
}

}  // namespace trocar
