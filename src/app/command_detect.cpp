// `trocar detect`: all intersecting triangle pairs of two mesh files, by one detector or by all of them, held against
// the exact oracle.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "app/commands.hpp"
#include "app/detector_answers.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/mesh_text.hpp"
#include "scene/mesh_pair.hpp"

namespace trocar::app {
namespace {

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

std::string milliseconds(std::int64_t ns) {
    return ns < 0 ? "-" : fmt::format("{:.3f}", static_cast<double>(ns) * 1e-6);
}

/// The one frame; an empty answer of a detector that gave none.
FrameAnswer only_frame(const DetectorAnswer& answer) {
    return answer.frames.empty() ? FrameAnswer{} : answer.frames.front();
}

void print_json(const std::vector<DetectorAnswer>& answers, const TickTruth* truth) {
    fmt::memory_buffer text;
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "{{\"detectors\":[");
    for (const DetectorAnswer& answer : answers) {
        fmt::format_to(out, "{}{{\"name\":{},\"outcome\":\"{}\",\"message\":{},", &answer == answers.data() ? "" : ",",
                       quoted_json(answer.name), name_of(answer.outcome.kind), quoted_json(answer.outcome.message));
        append_json(only_frame(answer), text);
        fmt::format_to(out, "}}");
    }
    fmt::format_to(out, "],\"truth\":{}}}\n", truth != nullptr ? fmt::format("{}", truth->pairs.size()) : "null");
    std::fwrite(text.data(), 1, text.size(), stdout);
}

/// One line "i j" per pair, then a summary in comment lines.
void print_pairs(const DetectorAnswer& answer, const TickTruth* truth) {
    const FrameAnswer frame = only_frame(answer);
    fmt::memory_buffer text;
    for (std::size_t k = 0; k < frame.pairs.size(); ++k) {
        const bool touches = std::binary_search(frame.touch.begin(), frame.touch.end(), static_cast<Index>(k));
        fmt::format_to(std::back_inserter(text), "{} {}{}\n", frame.pairs[k].a, frame.pairs[k].b,
                       touches ? " touch" : "");
    }
    std::fwrite(text.data(), 1, text.size(), stdout);
    if (answer.outcome.ok()) {
        fmt::print("# {}: {} pairs, {} of them only touch; update {} ms, detect {} ms\n", answer.name,
                   frame.pairs.size(), frame.touch.size(), milliseconds(frame.update_ns),
                   milliseconds(frame.detect_ns));
    }
    if (frame.truncated) fmt::print("# {}\n", answer.outcome.message);
    if (frame.errors) {
        fmt::print("# exact oracle: {} pairs, {} false negatives, {} false positives\n", truth->pairs.size(),
                   frame.errors->false_negatives, frame.errors->false_positives);
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
    const std::vector<MethodSpec> methods = detectors_named(options.detector);
    check_time_limit(options.time_limit_s);
    const Mesh a = posed_mesh(options.file_a, "a", options.pose_a, options.scale_a);
    const Mesh b = posed_mesh(options.file_b, "b", options.pose_b, options.scale_b);
    const MeshPair question = make_mesh_pair(a, b);
    if (options.write_posed) write_posed(*options.write_posed, a, b);

    const Topology& topology = question.topology;
    const AskedFrames frames{topology, 1, [&question](std::int64_t, Frame& frame) { frame = question.frame; }};
    std::vector<DetectorAnswer> answers;
    answers.reserve(methods.size());
    for (const MethodSpec& method : methods) answers.push_back(ask(method, frames, options.time_limit_s));
    const bool judged = all || options.truth;
    Truths truths(1);
    if (judged) truths.front() = truth_of(topology, question.frame);
    const TickTruth* const truth = judged ? &*truths.front() : nullptr;
    const Index first_of_b = topology.bodies[1].triangles.first;
    const auto number_in_file = [first_of_b](Index triangle) {
        return triangle < first_of_b ? triangle : triangle - first_of_b;
    };
    for (DetectorAnswer& answer : answers) {
        if (answer.frames.empty()) continue;
        FrameAnswer& frame = answer.frames.front();
        judge(topology, question.frame, truth, number_in_file, frame);
        answer.outcome = frame.outcome;
        if (frame.truncated && answer.outcome.message.empty()) {
            answer.outcome.message = "truncated: a limit cut the list of pairs";
        }
    }
    const int status = conclude(all, answers);
    if (common.json) {
        print_json(answers, truth);
    } else if (all) {
        print_answers(answers, &truths);
    } else {
        print_pairs(answers.front(), truth);
    }
    return status;
}

}  // namespace trocar::app
