// `trocar detect`: all intersecting triangle pairs of two mesh files, by one detector or by all of them, held against
// the exact oracle. Each detector works in a child process, since a library may crash on what it is given.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "app/commands.hpp"
#include "app/isolated_call.hpp"
#include "app/pair_answer.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/mesh_text.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/mesh_pair.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

struct GivenPose {
    Vector3 translation;
    Vector3 rotation_degrees;
};

GivenPose parse_pose(const char* option, const std::string& text) {
    std::array<double, 6> numbers{};
    std::size_t count = 0;
    std::istringstream words(text);
    for (std::string word; words >> word; ++count) {
        const std::optional<double> value = mesh_text::parse_double(word);
        if (!value || !std::isfinite(*value))
            throw InputError("command line", option, "six finite numbers", "'" + word + "'");
        if (count < numbers.size()) numbers.at(count) = *value;
    }
    if (count != numbers.size()) {
        throw InputError("command line", option, "six numbers \"x y z rx ry rz\"", std::to_string(count));
    }
    return {Vector3(numbers[0], numbers[1], numbers[2]), Vector3(numbers[3], numbers[4], numbers[5])};
}

Mesh posed_mesh(const std::filesystem::path& file, const std::string& letter, const std::string& pose, double scale) {
    const std::string pose_option = "--pose-" + letter;
    const GivenPose given = parse_pose(pose_option.c_str(), pose);
    if (!std::isfinite(scale) || scale <= 0.0) {
        throw InputError("command line", "--scale-" + letter, "a finite number > 0", fmt::format("{}", scale));
    }
    Mesh mesh = read_mesh(file);
    pose_vertices(scale, given.translation, given.rotation_degrees, mesh.vertices);
    if (!mesh.vertices.allFinite()) {
        throw InputError("command line", pose_option, "coordinates that stay finite under scale and pose", "overflow");
    }
    for (const std::string& surface : mesh.ignored) {
        fmt::print(stderr, "trocar: {}: {}: not read (only polygons are)\n", file.string(), surface);
    }
    return mesh;
}

/// What one detector said, and how it ended.
struct JudgedAnswer {
    std::string name = {};
    bool claims_exact = false;
    Outcome outcome = {};
    bool truncated = false;
    std::vector<TrianglePair> pairs = {};
    std::optional<std::int64_t> update_ns = {};
    std::optional<std::int64_t> detect_ns = {};
    std::optional<PairErrors> errors = {};
};

/// One tick after prepare, as bytes: this runs in the child.
std::string answer_bytes(const MethodSpec& method, const MeshPair& question) {
    using Clock = std::chrono::steady_clock;
    ContactSet contacts;
    std::int64_t update_ns = -1;
    std::int64_t detect_ns = -1;
    bool bad_input_found = false;
    try {
        const std::unique_ptr<Detector> detector = make_detector(method.name, method.parameters);
        detector->prepare(question.topology, question.frame);
        const Clock::time_point start = Clock::now();
        detector->update(question.frame, 0.0);
        const Clock::time_point updated = Clock::now();
        detector->detect(question.frame, contacts);
        const Clock::time_point detected = Clock::now();
        update_ns = std::chrono::nanoseconds(updated - start).count();
        detect_ns = std::chrono::nanoseconds(detected - updated).count();
    } catch (const InputError& error) {
        bad_input_found = true;
        contacts.outcome.message = error.what();
    } catch (const std::exception& error) {
        contacts.outcome = {OutcomeKind::threw, error.what()};
    }
    const Json head{{"input_error", bad_input_found},
                    {"outcome", name_of(contacts.outcome.kind)},
                    {"message", contacts.outcome.message},
                    {"truncated", contacts.truncated},
                    {"update_ns", update_ns},
                    {"detect_ns", detect_ns}};
    std::string bytes = head.dump(-1, ' ', false, Json::error_handler_t::replace);
    bytes.push_back('\n');
    for (const TrianglePair& pair : contacts.pairs) {
        std::array<char, sizeof pair> raw{};
        std::memcpy(raw.data(), &pair, sizeof pair);
        bytes.append(raw.data(), raw.size());
    }
    return bytes;
}

JudgedAnswer ask(const MethodSpec& method, const MeshPair& question, double time_limit_s) {
    const DetectorEntry& entry = registry().detector(method.name);
    // Checks the values here, where bad input ends the program.
    [[maybe_unused]] const ParameterValues checked(entry.name, entry.parameters, method.parameters);
    JudgedAnswer answer{.name = method.text(), .claims_exact = entry.claims_exact};
    const IsolatedResult result =
        call_isolated([&method, &question] { return answer_bytes(method, question); }, time_limit_s);
    if (result.kind != IsolatedResult::Kind::complete) {
        const bool crashed = result.kind == IsolatedResult::Kind::crashed;
        answer.outcome = {crashed ? OutcomeKind::crashed : OutcomeKind::timed_out, result.message};
        return answer;
    }
    const std::size_t head_end = result.bytes.find('\n');
    const Json head = Json::parse(result.bytes.substr(0, head_end));
    if (head.at("input_error").get<bool>()) throw InputError(head.at("message").get<std::string>());
    answer.outcome = {outcome_kind_from(head.at("outcome").get<std::string>()), head.at("message")};
    answer.truncated = head.at("truncated");
    if (answer.truncated && answer.outcome.message.empty()) {
        answer.outcome.message = "truncated: a limit cut the list of pairs";
    }
    if (!answer.outcome.ok()) return answer;
    answer.update_ns = head.at("update_ns").get<std::int64_t>();
    answer.detect_ns = head.at("detect_ns").get<std::int64_t>();
    const std::size_t size = result.bytes.size() - head_end - 1;
    answer.pairs.resize(size / sizeof(TrianglePair));
    if (size > 0) std::memcpy(answer.pairs.data(), result.bytes.data() + head_end + 1, size);
    return answer;
}

/// All pairs that anybody reported and that only touch, sorted; each is classified once.
std::vector<TrianglePair> touching(const MeshPair& question, const std::vector<JudgedAnswer>& answers,
                                   const std::vector<TrianglePair>& truth) {
    std::vector<TrianglePair> reported = truth;
    for (const JudgedAnswer& answer : answers)
        reported.insert(reported.end(), answer.pairs.begin(), answer.pairs.end());
    std::sort(reported.begin(), reported.end());
    reported.erase(std::unique(reported.begin(), reported.end()), reported.end());
    std::vector<TrianglePair> touch;
    for (const Index k : touching_pairs(question.topology, question.frame, reported)) {
        touch.push_back(reported[static_cast<std::size_t>(k)]);
    }
    return touch;
}

std::vector<Index> touch_positions(const std::vector<TrianglePair>& pairs, const std::vector<TrianglePair>& touch) {
    std::vector<Index> positions;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        if (std::binary_search(touch.begin(), touch.end(), pairs[k])) positions.push_back(static_cast<Index>(k));
    }
    return positions;
}

struct Verdict {
    std::vector<JudgedAnswer> answers;
    std::optional<std::vector<TrianglePair>> truth;
    std::vector<TrianglePair> touch;
    Index first_of_b = 0;  ///< global number of triangle 0 of file b
};

void print_json(const Verdict& verdict) {
    fmt::memory_buffer text;
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "{{\"detectors\":[");
    for (std::size_t d = 0; d < verdict.answers.size(); ++d) {
        const JudgedAnswer& answer = verdict.answers[d];
        const std::vector<Index> touch = touch_positions(answer.pairs, verdict.touch);
        fmt::format_to(out, "{}{{\"name\":{},\"outcome\":\"{}\",\"message\":{},", d > 0 ? "," : "",
                       quoted_json(answer.name), name_of(answer.outcome.kind), quoted_json(answer.outcome.message));
        append_json({.pairs = answer.pairs,
                     .first_of_b = verdict.first_of_b,
                     .touch = touch,
                     .errors = answer.errors,
                     .update_ns = answer.update_ns,
                     .detect_ns = answer.detect_ns},
                    text);
        fmt::format_to(out, "}}");
    }
    fmt::format_to(out, "],\"truth\":{}}}\n",
                   verdict.truth ? fmt::format("{}", verdict.truth->size()) : std::string("null"));
    std::fwrite(text.data(), 1, text.size(), stdout);
}

std::string milliseconds(const std::optional<std::int64_t>& ns) {
    return ns ? fmt::format("{:.3f}", static_cast<double>(*ns) * 1e-6) : "-";
}

void print_table(const Verdict& verdict) {
    constexpr const char* row = "{:<24} {:<12} {:>9} {:>7} {:>8} {:>7} {:>10} {:>10}  {}\n";
    fmt::print(fmt::runtime(row), "detector", "outcome", "pairs", "touch", "FN", "FP", "update ms", "detect ms",
               "message");
    if (verdict.truth) {
        fmt::print(fmt::runtime(row), "exact oracle", "ok", verdict.truth->size(),
                   touch_positions(*verdict.truth, verdict.touch).size(), "-", "-", "-", "-", "truth");
    }
    for (const JudgedAnswer& answer : verdict.answers) {
        const auto count = [&answer](std::int64_t PairErrors::*which) {
            return answer.errors ? std::to_string((*answer.errors).*which) : std::string("-");
        };
        const bool ok = answer.outcome.ok();
        fmt::print(fmt::runtime(row), answer.name, name_of(answer.outcome.kind),
                   ok ? std::to_string(answer.pairs.size()) : "-",
                   ok ? std::to_string(touch_positions(answer.pairs, verdict.touch).size()) : "-",
                   count(&PairErrors::false_negatives), count(&PairErrors::false_positives),
                   milliseconds(answer.update_ns), milliseconds(answer.detect_ns), answer.outcome.message);
    }
    fmt::print("Times are those of one tick after prepare; a study measures many.\n");
}

/// One line "i j" per pair, then a summary in comment lines.
void print_pairs(const Verdict& verdict) {
    const JudgedAnswer& answer = verdict.answers.front();
    const std::vector<Index> touch = touch_positions(answer.pairs, verdict.touch);
    fmt::memory_buffer text;
    for (std::size_t k = 0; k < answer.pairs.size(); ++k) {
        const bool touches = std::binary_search(touch.begin(), touch.end(), static_cast<Index>(k));
        fmt::format_to(std::back_inserter(text), "{} {}{}\n", answer.pairs[k].a, answer.pairs[k].b - verdict.first_of_b,
                       touches ? " touch" : "");
    }
    std::fwrite(text.data(), 1, text.size(), stdout);
    if (answer.outcome.ok()) {
        fmt::print("# {}: {} pairs, {} of them only touch; update {} ms, detect {} ms\n", answer.name,
                   answer.pairs.size(), touch.size(), milliseconds(answer.update_ns), milliseconds(answer.detect_ns));
    }
    if (answer.truncated) fmt::print("# {}\n", answer.outcome.message);
    if (answer.errors) {
        fmt::print("# exact oracle: {} pairs, {} false negatives, {} false positives\n", verdict.truth->size(),
                   answer.errors->false_negatives, answer.errors->false_positives);
    }
}

void write_posed(const std::filesystem::path& folder, const Mesh& a, const Mesh& b) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) throw InputError(folder.string(), "", "a folder that can be made", error.message());
    write_obj(folder / "a.obj", a.vertices, a.triangles);
    write_obj(folder / "b.obj", b.vertices, b.triangles);
}

}  // namespace

int detect(const CommonOptions& common, const DetectOptions& options) {
    const bool all = options.detector == "all";
    std::vector<MethodSpec> methods;
    if (all) {
        for (const DetectorEntry& entry : registry().detectors()) {
            if (!entry.control) methods.push_back({.name = entry.name});
        }
    } else {
        methods.push_back(parse_method(options.detector));
        static_cast<void>(registry().detector(methods.front().name));  // an unknown name ends here
    }
    if (!(options.time_limit_s > 0.0)) {
        throw InputError("command line", "--time-limit", "seconds > 0", fmt::format("{}", options.time_limit_s));
    }
    const Mesh a = posed_mesh(options.file_a, "a", options.pose_a, options.scale_a);
    const Mesh b = posed_mesh(options.file_b, "b", options.pose_b, options.scale_b);
    const MeshPair question = make_mesh_pair(a, b);
    if (options.write_posed) write_posed(*options.write_posed, a, b);

    Verdict verdict{.answers = {}, .truth = {}, .touch = {}, .first_of_b = question.topology.bodies[1].triangles.first};
    for (const MethodSpec& method : methods) {
        verdict.answers.push_back(ask(method, question, options.time_limit_s));
    }
    if (all || options.truth) true_pairs(question.topology, question.frame, verdict.truth.emplace());
    verdict.touch = touching(question, verdict.answers, verdict.truth.value_or(std::vector<TrianglePair>{}));
    int status = done;
    if (verdict.truth) {
        const std::vector<Index> truth_touch = touch_positions(*verdict.truth, verdict.touch);
        for (JudgedAnswer& answer : verdict.answers) {
            if (!answer.outcome.ok()) continue;
            answer.errors = compare_pairs(answer.pairs, *verdict.truth, truth_touch);
            const bool differs = answer.errors->false_negatives > 0 || answer.errors->false_positives > 0;
            if (!differs || !answer.claims_exact || answer.truncated) continue;
            status = comparison_failed;
            fmt::print(
                stderr,
                "trocar: {} claims exactness and differs from the oracle: {} false negatives, {} false positives\n",
                answer.name, answer.errors->false_negatives, answer.errors->false_positives);
        }
    }
    if (all) {
        for (const AbsentMethod& absent : registry().absent_detectors()) {
            verdict.answers.push_back({.name = absent.name, .outcome = {OutcomeKind::absent, absent.reason}});
        }
    } else if (const JudgedAnswer& answer = verdict.answers.front(); !answer.outcome.ok()) {
        status = method_failed;
        fmt::print(stderr, "trocar: {}: {}: {}\n", answer.name, name_of(answer.outcome.kind), answer.outcome.message);
    }
    if (common.json) {
        print_json(verdict);
    } else if (all) {
        print_table(verdict);
    } else {
        print_pairs(verdict);
    }
    return status;
}

}  // namespace trocar::app
