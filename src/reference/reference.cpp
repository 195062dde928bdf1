#include "reference/reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"

namespace trocar {
namespace {

using OrderedJson = nlohmann::ordered_json;
constexpr const char* format_name = "trocar-reference-1";

OrderedJson number(double value) { return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr); }

/// Stored numbers carry what the reference knows and no more digits.
double rounded(double value, double grain) { return std::round(value / grain) * grain; }

/// As few digits as give the value to the grain.
std::string short_number(double value, double grain) {
    std::string text =
        fmt::format("{:.{}f}", rounded(value, grain), static_cast<int>(std::max(0L, std::lround(-std::log10(grain)))));
    while (text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
    return text == "-0" ? "0" : text;
}

/// Columns as lists, written by hand: a JSON library would print 0.30000000000000004.
std::string columns_text(const Matrix3X& columns, double grain) {
    std::string text = "[";
    for (Eigen::Index c = 0; c < columns.cols(); ++c) {
        if (c > 0) text += ",";
        text += fmt::format("[{},{},{}]", short_number(columns(0, c), grain), short_number(columns(1, c), grain),
                            short_number(columns(2, c), grain));
    }
    return text + "]";
}

/// Every number of a solution and its key.
std::vector<std::pair<const char*, double ReferenceSolution::*>> numbers() {
    return {{"until", &ReferenceSolution::until},
            {"time_step", &ReferenceSolution::time_step},
            {"residual", &ReferenceSolution::residual},
            {"worst_gap", &ReferenceSolution::worst_gap},
            {"rest_gap", &ReferenceSolution::rest_gap},
            {"order_time_step", &ReferenceSolution::order_time_step},
            {"order_stiffness", &ReferenceSolution::order_stiffness},
            {"force_bound", &ReferenceSolution::force_bound},
            {"impulse_bound", &ReferenceSolution::impulse_bound},
            {"position_bound", &ReferenceSolution::position_bound},
            {"max_strain", &ReferenceSolution::max_strain},
            {"max_strain_time", &ReferenceSolution::max_strain_time},
            {"final_strain", &ReferenceSolution::final_strain},
            {"sample_interval", &ReferenceSolution::sample_interval},
            {"position_interval", &ReferenceSolution::position_interval}};
}

OrderedJson pair_json(const std::array<double, 2>& pair) {
    return OrderedJson::array({number(pair[0]), number(pair[1])});
}

OrderedJson refinement_json(const Refinement& refinement) {
    return {{"force", pair_json(refinement.force)},
            {"impulse", pair_json(refinement.impulse)},
            {"position", pair_json(refinement.position)},
            {"force_floor", number(refinement.force_floor)}};
}

std::string solution_text(const ReferenceSolution& solution) {
    OrderedJson head{{"available", solution.available}, {"reason", solution.reason}};
    for (const auto& [key, member] : numbers()) head[key] = number(solution.*member);
    head["strain_range"] = pair_json(solution.strain_range);
    head["clears_within_strain_limit"] =
        solution.clears_within_strain_limit ? OrderedJson(*solution.clears_within_strain_limit) : OrderedJson(nullptr);
    head["by_time_step"] = refinement_json(solution.by_time_step);
    head["by_stiffness"] = refinement_json(solution.by_stiffness);
    head["points"] = solution.points;
    std::string text = head.dump();
    text.pop_back();
    text += ",\n  \"force\":" + columns_text(solution.force, 1e-6);
    text += ",\n  \"positions\":[";
    for (std::size_t i = 0; i < solution.positions.size(); ++i) {
        text += (i > 0 ? ",\n   " : "\n   ") + columns_text(solution.positions[i], 1e-8);
    }
    return text + "]}";
}

double number_or_unset(const JsonNode& node) { return node.is_null() ? not_known : node.number(); }

std::array<double, 2> pair_from(const JsonNode& node) {
    const std::vector<JsonNode> list = node.list();
    if (list.size() != 2) node.fail("two numbers");
    return {number_or_unset(list[0]), number_or_unset(list[1])};
}

Refinement refinement_from(const JsonNode& node) {
    return {.force = pair_from(node.at("force")),
            .impulse = pair_from(node.at("impulse")),
            .position = pair_from(node.at("position")),
            .force_floor = number_or_unset(node.at("force_floor"))};
}

Matrix3X columns_from(const JsonNode& node) {
    const std::vector<JsonNode> points = node.list();
    Matrix3X columns(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t c = 0; c < points.size(); ++c) columns.col(static_cast<Eigen::Index>(c)) = points[c].vector3();
    return columns;
}

ReferenceSolution solution_from(const JsonNode& node) {
    ReferenceSolution solution;
    solution.available = node.at("available").flag();
    solution.reason = node.at("reason").any_text();
    for (const auto& [key, member] : numbers()) solution.*member = number_or_unset(node.at(key));
    solution.strain_range = pair_from(node.at("strain_range"));
    const JsonNode clears = node.at("clears_within_strain_limit");
    if (!clears.is_null()) solution.clears_within_strain_limit = clears.flag();
    solution.by_time_step = refinement_from(node.at("by_time_step"));
    solution.by_stiffness = refinement_from(node.at("by_stiffness"));
    for (const JsonNode& point : node.at("points").list()) {
        solution.points.push_back(static_cast<Index>(point.integer(0, std::numeric_limits<Index>::max())));
    }
    solution.force = columns_from(node.at("force"));
    for (const JsonNode& places : node.at("positions").list()) {
        solution.positions.push_back(columns_from(places));
        if (at(solution.positions.back().cols()) != solution.points.size()) {
            places.fail("as many points as `points` has", fmt::format("{}", solution.positions.back().cols()));
        }
    }
    if (solution.available) {
        solution.sample_interval = node.at("sample_interval").positive();
        solution.position_interval = node.at("position_interval").positive();
        solution.until = node.at("until").non_negative();
        if (solution.force.cols() == 0) node.at("force").fail("at least one sample", "none");
        if (solution.positions.empty()) node.at("positions").fail("at least one sample", "none");
    }
    return solution;
}

/// Left sample and weight of the right one.
std::pair<Eigen::Index, double> place_between(double time, double interval, Eigen::Index count) {
    const double x = std::clamp(time / interval, 0.0, static_cast<double>(count - 1));
    const auto left = std::min(static_cast<Eigen::Index>(x), std::max<Eigen::Index>(count - 2, 0));
    return {left, count > 1 ? x - static_cast<double>(left) : 0.0};
}

std::string clearing_text(const ReferenceSolution& solution) {
    if (!solution.clears_within_strain_limit) return "";
    if (*solution.clears_within_strain_limit) {
        return fmt::format("; clears within the strain limit (largest edge strain {:.2f})", solution.max_strain);
    }
    return fmt::format("; does not clear within the strain limit (edge strain {:.2f} at {:.2f} s)", solution.max_strain,
                       solution.max_strain_time);
}

bool equal_or_both_unset(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// What the file for this contact stiffness holds, or for both laws why nothing.
FoundReference look_up(const Scene& scene, double turned_k) {
    const auto none = [](ReferenceState state, const std::string& reason) {
        FoundReference found{.state = state, .reference = {}};
        found.reference.hard.reason = reason;
        found.reference.equal_k.reason = reason;
        return found;
    };
    if (scene.file.empty()) return none(ReferenceState::missing, "the scene was not read from a file");
    const std::filesystem::path file = reference_file(scene.file, turned_k);
    std::error_code error;
    if (!std::filesystem::exists(file, error)) {
        return none(ReferenceState::missing, std::isnan(turned_k)
                                                 ? "none is stored for this scene"
                                                 : fmt::format("none is stored for k = {} N/m", turned_k));
    }
    FoundReference found{.state = ReferenceState::present, .reference = {}};
    try {
        found.reference = read_reference(file);
    } catch (const InputError& fault) {
        return none(ReferenceState::stale, fmt::format("the stored one cannot be read, make it anew by trocar "
                                                       "reference: {}",
                                                       fault.what()));
    }
    if (found.reference.scene_hash != fmt::format("{:016x}", scene.hash)) {
        return none(ReferenceState::stale, "the stored one belongs to another state of the scene");
    }
    if (!equal_or_both_unset(found.reference.turned_k, turned_k)) {
        return none(ReferenceState::stale, "the stored one belongs to another k");
    }
    return found;
}

}  // namespace

Vector3 ReferenceSolution::force_at(double time) const {
    const auto [left, weight] = place_between(time, sample_interval, force.cols());
    const Eigen::Index right = std::min(left + 1, force.cols() - 1);
    return (1.0 - weight) * force.col(left) + weight * force.col(right);
}

Matrix3X ReferenceSolution::positions_at(double time) const {
    const auto count = static_cast<Eigen::Index>(positions.size());
    const auto [left, weight] = place_between(time, position_interval, count);
    const auto right = static_cast<std::size_t>(std::min(left + 1, count - 1));
    return (1.0 - weight) * positions[static_cast<std::size_t>(left)] + weight * positions[right];
}

std::filesystem::path reference_file(const std::filesystem::path& scene_file, double turned_k) {
    const std::string which = std::isnan(turned_k) ? "" : fmt::format(".k={}", turned_k);
    return scene_file.parent_path() / "reference" / (scene_file.stem().string() + which + ".json");
}

std::string hash_of_references(const std::filesystem::path& scene_file) {
    const std::filesystem::path own = reference_file(scene_file);
    const std::string other_k = own.stem().string() + ".k=";
    std::set<std::filesystem::path> files;  // in order of name
    std::error_code error;
    const std::filesystem::directory_iterator end;
    for (std::filesystem::directory_iterator entry(own.parent_path(), error); !error && entry != end;
         entry.increment(error)) {
        const std::filesystem::path& file = entry->path();
        const bool is_other_k = file.extension() == ".json" && file.filename().string().starts_with(other_k);
        if (file == own || is_other_k) files.insert(file);
    }
    FnvHash hash;
    for (const std::filesystem::path& file : files) {
        hash.add_text(file.filename().string() + ":");
        hash.add_text(read_whole(file, "a stored reference"));
    }
    return files.empty() ? "" : hash.text();
}

Reference read_reference(const std::filesystem::path& file) {
    const std::string name = file.string();
    const Json document = parse_json(read_whole(file, "a stored reference"), name);
    const JsonNode root(document, name);
    root.at("format").expect_word(format_name);
    Reference reference;
    reference.scene = root.at("scene").text();
    reference.scene_hash = root.at("scene_hash").any_text();
    if (const auto turned_k = root.find("turned_k")) reference.turned_k = number_or_unset(*turned_k);
    const JsonNode origin = root.at("origin");
    for (const std::string& key : origin.keys()) reference.origin[key] = origin.at(key).any_text();
    reference.hard = solution_from(root.at("hard"));
    reference.equal_k = solution_from(root.at("equal_k"));
    return reference;
}

std::string to_json(const Reference& reference) {
    OrderedJson head{{"format", format_name}, {"scene", reference.scene}, {"scene_hash", reference.scene_hash}};
    if (!std::isnan(reference.turned_k)) head["turned_k"] = reference.turned_k;
    head["origin"] = OrderedJson::object();
    for (const auto& [key, value] : reference.origin) head["origin"][key] = value;
    std::string text = head.dump();
    text.pop_back();
    text += ",\n \"hard\":" + solution_text(reference.hard);
    text += ",\n \"equal_k\":" + solution_text(reference.equal_k);
    return text + "}\n";
}

std::string text_of(const ReferenceSolution& solution) {
    if (!solution.available) return "no reference (" + solution.reason + ")" + clearing_text(solution);
    const auto order = [](double value, const Refinement& refinement) {
        if (std::isfinite(value)) return fmt::format("{:.1f}", value);
        return fmt::format("n/a (last differences {:.1g} and {:.1g} N, counted as none up to {:.1g} N)",
                           refinement.force[0], refinement.force[1], refinement.force_floor);
    };
    return fmt::format(
        "order in step {}, in stiffness {}; residual {:.1e}; bound {:.2g} N RMS{}{}",
        order(solution.order_time_step, solution.by_time_step), order(solution.order_stiffness, solution.by_stiffness),
        solution.residual, solution.force_bound,
        solution.reason.empty() ? "" : fmt::format("; up to {:g} s: {}", solution.until, solution.reason),
        clearing_text(solution));
}

std::string FoundReference::message() const {
    const std::string hard = text_of(reference.hard);
    const std::string equal_k = text_of(reference.equal_k);
    return hard == equal_k ? hard : fmt::format("hard contact: {}. Equal k: {}.", hard, equal_k);
}

FoundReference find_reference(const Scene& scene) {
    FoundReference found = look_up(scene, scene.turned_k);
    if (!std::isnan(scene.turned_k)) {
        found.reference.hard = look_up(scene, not_known).reference.hard;
    }
    return found;
}

std::vector<Vector3> low_pass(const std::vector<Vector3>& samples, double dt, double cutoff) {
    if (samples.empty()) return {};
    // Bilinear transform of the second-order Butterworth low-pass with pre-warped cut-off.
    const double w = std::tan(std::numbers::pi * std::min(cutoff * dt, 0.49));
    const double scale = 1.0 / (1.0 + std::numbers::sqrt2 * w + w * w);
    const double b = w * w * scale;
    const double a1 = 2.0 * (w * w - 1.0) * scale;
    const double a2 = (1.0 - std::numbers::sqrt2 * w + w * w) * scale;
    std::vector<Vector3> result = samples;
    for (int pass = 0; pass < 2; ++pass) {
        Vector3 x1 = result.front();
        Vector3 x2 = x1;
        Vector3 y1 = x1;
        Vector3 y2 = x1;
        for (Vector3& value : result) {
            const Vector3 x = value;
            const Vector3 y = b * (x + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            x2 = x1;
            x1 = x;
            y2 = y1;
            y1 = y;
            value = y;
        }
        std::reverse(result.begin(), result.end());
    }
    return result;
}

ForceSize force_in_band(const std::vector<Vector3>& samples, double dt) {
    ForceSize size;
    double squares = 0.0;
    for (const Vector3& force : low_pass(samples, dt, force_band_hz)) {
        squares += force.squaredNorm();
        // fmax would swallow a NaN, which means that a run reported no force.
        size.worst = std::isnan(force.norm()) ? force.norm() : std::max(size.worst, force.norm());
    }
    size.rms = std::sqrt(squares / static_cast<double>(samples.size()));
    return size;
}

double largest_impulse(const std::vector<Vector3>& samples, double dt) {
    const auto window = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(impulse_window / dt)));
    double largest = 0.0;
    for (std::size_t first = 0; first + window <= samples.size(); first += window) {
        Vector3 sum = Vector3::Zero();
        for (std::size_t i = first; i < first + window; ++i) sum += dt * samples[i];
        largest = std::isnan(sum.norm()) ? sum.norm() : std::max(largest, sum.norm());
    }
    return largest;
}

ReferenceComparison::ReferenceComparison(const FoundReference& found, double dt) : dt_(dt) {
    const Reference& reference = found.reference;
    if (reference.equal_k.available) laws_[0].solution = &reference.equal_k;
    if (reference.hard.available) laws_[1].solution = &reference.hard;
    if (const auto& clears = reference.hard.clears_within_strain_limit) clears_ = *clears ? 1.0 : 0.0;
}

void ReferenceComparison::observe(double time, const Vector3& tool_force, const Matrix3X& position) {
    for (Law& law : laws_) {
        if (law.solution == nullptr || time > law.solution->until + 1e-9) continue;
        const Vector3 force = law.solution->force_at(time);
        law.force_difference.push_back(tool_force - force);
        law.force_max = std::max(law.force_max, force.norm());
        law.force_step = std::max(law.force_step, (force - law.force).norm());
        law.force = force;
        // The positions are those after the tick.
        const Matrix3X expected = law.solution->positions_at(time + dt_);
        for (std::size_t i = 0; i < law.solution->points.size(); ++i) {
            const Index vertex = law.solution->points[i];
            if (vertex >= position.cols()) continue;
            const double off = (position.col(vertex) - expected.col(static_cast<Eigen::Index>(i))).norm();
            law.position_squares += off * off;
            law.position_count += 1.0;
            law.position_worst = std::fmax(law.position_worst, off);
        }
    }
}

ReferenceErrors ReferenceComparison::errors() const {
    ReferenceErrors errors;
    for (std::size_t i = 0; i < laws_.size(); ++i) {
        const Law& law = laws_.at(i);
        const bool known = law.solution != nullptr && !law.force_difference.empty();
        const ForceSize size = known ? force_in_band(law.force_difference, dt_) : ForceSize{not_known, not_known};
        const bool places = known && law.position_count > 0.0;
        ReferenceErrors::Law& error = i == 0 ? errors.equal_k : errors.hard;
        error.force_rms = size.rms;
        error.force_worst = size.worst;
        error.impulse_worst = known ? largest_impulse(law.force_difference, dt_) : not_known;
        error.position_rms = places ? std::sqrt(law.position_squares / law.position_count) : not_known;
        error.position_worst = places ? law.position_worst : not_known;
        error.force_bound = known ? law.solution->force_bound : not_known;
        error.position_bound = places ? law.solution->position_bound : not_known;
        error.reference_max = known ? law.force_max : not_known;
        error.reference_step = known ? law.force_step : not_known;
    }
    errors.hard_clears = clears_;
    return errors;
}

}  // namespace trocar
