#include "study/tune.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/random.hpp"
#include "geometry/whole_file.hpp"
#include "measure/statistics.hpp"
#include "study/study_items.hpp"

namespace trocar {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr const char* tune_format = "trocar-tune-1";

TuneRange read_range(const JsonNode& node, const std::string& key) {
    expect_object(node, {"from", "to", "log"}, {"from", "to"});
    TuneRange range{.key = key, .from = node.at("from").number(), .to = node.at("to").number()};
    if (node.has("log")) range.log = node.at("log").flag();
    if (!(range.from < range.to)) node.fail("a range with from < to");
    if (range.log && !(range.from > 0.0)) node.at("from").fail("a number > 0 in a logarithmic range");
    return range;
}

TunedResponse read_tuned_response(const JsonNode& node) {
    expect_object(node, {"method", "contacts", "stepper", "ranges"}, {"method", "contacts", "ranges"});
    TunedResponse response;
    const Level level = read_method(node.at("method"), false);
    response.method = level.text;
    response.contacts = read_contact_generators(node.at("contacts"));
    if (node.has("stepper")) response.stepper = read_stepper(node.at("stepper"));
    const JsonNode ranges = node.at("ranges");
    for (const std::string& key : ranges.keys()) {
        const TuneRange range = read_range(ranges.at(key), key);
        for (const double value : {range.from, range.to}) {
            check_parameter(ranges.at(key), {level}, false, key, fmt::format("{}", value));
        }
        response.ranges.push_back(range);
    }
    const std::size_t parameters = response.ranges.size() + (response.contacts.size() > 1 ? 1 : 0);
    if (parameters < 1 || parameters > most_tuned_parameters) {
        ranges.fail(fmt::format("1 to {} parameters, the contact generator counted where there are several",
                                most_tuned_parameters),
                    std::to_string(parameters));
    }
    return response;
}

bool breaks(const ForceStepLimit& limit, const Summary& summary) {
    // A comparison with what is not known is false.
    return value_of(summary, Metric::force_jump_max_n) >
           limit.times_reference * value_of(summary, Metric::reference_force_step_hard) + limit.plus;
}

std::size_t dimensions_of(const TunedResponse& response) {
    return response.ranges.size() + (response.contacts.size() > 1 ? 1 : 0);
}

/// Direction numbers of the first four dimensions, as fractions of 2^32.
const std::array<std::array<std::uint32_t, 32>, most_tuned_parameters>& directions() {
    static const auto all = [] {
        struct Polynomial {
            std::uint32_t degree;
            std::uint32_t coefficients;
            std::array<std::uint32_t, 3> first;
        };
        constexpr std::array<Polynomial, 3> polynomials{{{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}}};
        std::array<std::array<std::uint32_t, 32>, most_tuned_parameters> v{};
        for (std::uint32_t i = 0; i < 32; ++i) v[0].at(i) = 1U << (31U - i);
        for (std::size_t d = 1; d < v.size(); ++d) {
            const Polynomial& p = polynomials.at(d - 1);
            for (std::uint32_t i = 0; i < 32; ++i) {
                if (i < p.degree) {
                    v.at(d).at(i) = p.first.at(i) << (31U - i);
                    continue;
                }
                std::uint32_t next = v.at(d).at(i - p.degree) ^ (v.at(d).at(i - p.degree) >> p.degree);
                for (std::uint32_t k = 1; k < p.degree; ++k) {
                    if (((p.coefficients >> (p.degree - 1 - k)) & 1U) != 0U) next ^= v.at(d).at(i - k);
                }
                v.at(d).at(i) = next;
            }
        }
        return v;
    }();
    return all;
}

void sort_by_score(std::vector<TuneSearch::Candidate>& candidates) {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.score < b.score; });
}

OrderedJson score_json(const TuneScore& score) {
    return {{"broken_on_scenes", score.broken},
            {"objective", std::isfinite(score.objective) ? OrderedJson(score.objective) : OrderedJson(nullptr)}};
}

}  // namespace

Tune read_tune(const std::filesystem::path& file, const std::vector<std::filesystem::path>& shipped) {
    const std::string file_name = file.string();
    const Json document = parse_json(read_whole(file, "a tune file"), file_name);
    const JsonNode root(document, file_name);
    expect_object(root,
                  {"format", "name", "seed", "time_limit_s", "detector", "depth_offset_m", "limits", "force_step_limit",
                   "scenes", "first_scenes", "budget", "responses"},
                  {"format", "name", "detector", "scenes", "responses"});
    root.at("format").expect_word(tune_format);
    Tune tune;
    tune.file = file;
    tune.name = root.at("name").text();
    if (root.has("seed")) tune.seed = root.at("seed").unsigned_integer();
    if (root.has("time_limit_s")) tune.time_limit_s = root.at("time_limit_s").positive();
    tune.detector = read_method(root.at("detector"), true).text;
    if (root.has("depth_offset_m")) tune.depth_offset = root.at("depth_offset_m").positive();
    if (root.has("limits")) {
        const JsonNode limits = root.at("limits");
        for (const std::string& key : limits.keys()) {
            const std::optional<Metric> metric = metric_named(key);
            if (!metric) limits.fail("names of metrics, as `trocar schema figures` lists them", key);
            tune.limits[*metric] = limits.at(key).non_negative();
        }
    }
    if (root.has("force_step_limit")) {
        const JsonNode limit = root.at("force_step_limit");
        expect_object(limit, {"times_reference", "plus_N"}, {"times_reference", "plus_N"});
        if (tune.limits.contains(Metric::force_jump_max_n)) limit.fail("it or a limit on force_jump_max_n", "both");
        tune.force_step = {.times_reference = limit.at("times_reference").non_negative(),
                           .plus = limit.at("plus_N").non_negative()};
    }
    for (const std::string& scene : read_scenes(root.at("scenes"), {file, shipped})) {
        tune.scenes.push_back(std::filesystem::absolute(file.parent_path() / scene).lexically_normal().string());
    }
    const auto size = [](const char* key, const JsonNode& node, std::size_t& value) {
        if (node.has(key)) value = static_cast<std::size_t>(count_of(node.at(key)));
    };
    size("first_scenes", root, tune.first_scenes);
    if (tune.first_scenes > tune.scenes.size()) {
        root.fail("first_scenes of at most all scenes", std::to_string(tune.first_scenes));
    }
    if (root.has("budget")) {
        const JsonNode budget = root.at("budget");
        expect_object(budget, {"first", "second", "local"}, {});
        size("first", budget, tune.first);
        size("second", budget, tune.second);
        size("local", budget, tune.local);
        if (tune.second > tune.first) budget.at("second").fail("at most first");
        if (tune.local % local_rounds != 0) budget.at("local").fail(fmt::format("a multiple of {}", local_rounds));
    }
    for (const JsonNode& item : items_of(root.at("responses"))) tune.responses.push_back(read_tuned_response(item));
    return tune;
}

std::vector<double> sobol_point(std::uint64_t index, std::size_t dimensions) {
    const std::uint64_t gray = index ^ (index >> 1U);
    std::vector<double> point(dimensions);
    for (std::size_t d = 0; d < dimensions; ++d) {
        std::uint32_t sum = 0;
        for (std::size_t bit = 0; bit < 32; ++bit) {
            if (((gray >> bit) & 1U) != 0U) sum ^= directions().at(d).at(bit);
        }
        point[d] = sum * 0x1p-32;
    }
    return point;
}

TuneSetting setting_at(const TunedResponse& response, const std::vector<double>& place) {
    Level level{.text = response.method};
    for (std::size_t i = 0; i < response.ranges.size(); ++i) {
        const TuneRange& range = response.ranges[i];
        const double value = range.log ? range.from * std::pow(range.to / range.from, place[i])
                                       : range.from + place[i] * (range.to - range.from);
        // Three digits name a setting; rounding may not leave the range.
        const double rounded = std::clamp(std::stod(fmt::format("{:.3g}", value)), range.from, range.to);
        level = with_parameter(level, range.key, fmt::format("{}", rounded));
    }
    const std::size_t several = response.contacts.size();
    const auto choice =
        several > 1 ? std::min(several - 1, static_cast<std::size_t>(place.back() * static_cast<double>(several))) : 0;
    return {.response = level.text, .contacts = response.contacts[choice]};
}

TuneScore score_of(const Tune& tune, const std::vector<const Record*>& records) {
    TuneScore score;
    std::vector<double> logs;
    logs.reserve(records.size());
    for (const Record* record : records) {
        const double depth =
            record->outcome.ok() ? value_of(record->summary, Metric::residual_penetration_max_m) : not_known;
        bool broken = std::isnan(depth);
        for (const auto& [metric, most] : tune.limits) broken = broken || value_of(record->summary, metric) > most;
        broken = broken || (tune.force_step && breaks(*tune.force_step, record->summary));
        score.broken += broken ? 1 : 0;
        logs.push_back(std::isnan(depth) ? std::numeric_limits<double>::infinity()
                                         : std::log(depth + tune.depth_offset));
    }
    score.objective = median(std::move(logs));
    return score;
}

TuneSearch::TuneSearch(const Tune& tune, const TunedResponse& response, int start)
    : tune_(&tune), response_(&response), start_(start) {}

std::vector<std::vector<double>> TuneSearch::places(int stage) const {
    const std::size_t dimensions = dimensions_of(*response_);
    Random random(tune_->seed * 1000 + static_cast<std::uint64_t>(10 * start_ + stage));
    std::vector<std::vector<double>> list;
    if (stage == 0) {
        std::vector<double> shift(dimensions);
        for (double& one : shift) one = 0.5 + 0.5 * random.signed_unit();
        for (std::size_t i = 0; i < tune_->first; ++i) {
            list.push_back(sobol_point(i, dimensions));
            for (std::size_t d = 0; d < dimensions; ++d) list.back()[d] = std::fmod(list.back()[d] + shift[d], 1.0);
        }
        return list;
    }
    if (stage == 1) {
        for (std::size_t i = 0; i < tune_->second; ++i) list.push_back(first_[i].place);
        return list;
    }
    // A box around the best, halved with every round.
    const double half = 0.2 * std::pow(0.5, stage - 2);
    for (std::size_t i = 0; i < tune_->local / local_rounds; ++i) {
        std::vector<double> place = best().place;
        for (double& one : place) one = std::clamp(one + half * random.signed_unit(), 0.0, 1.0);
        list.push_back(std::move(place));
    }
    return list;
}

std::vector<TuneSetting> TuneSearch::settings(int stage) const {
    std::vector<TuneSetting> list;
    for (const std::vector<double>& place : places(stage)) list.push_back(setting_at(*response_, place));
    return list;
}

void TuneSearch::take_scores(int stage, const std::vector<TuneScore>& scores) {
    const std::vector<std::vector<double>> all_places = places(stage);
    std::vector<Candidate>& list = stage == 0 ? first_ : all_;
    for (std::size_t i = 0; i < scores.size(); ++i) {
        list.push_back({all_places[i], setting_at(*response_, all_places[i]), scores[i]});
    }
    sort_by_score(list);
}

const TuneSearch::Candidate& TuneSearch::best() const { return all_.front(); }

std::string tune_stage_text(const Tune& tune, int stage, const std::vector<std::vector<TuneSetting>>& settings) {
    std::vector<std::string> scenes = tune.scenes;
    if (stage == 0) scenes.resize(tune.first_scenes);
    OrderedJson experiments = OrderedJson::array();
    for (std::size_t i = 0; i < settings.size(); ++i) {
        OrderedJson responses = OrderedJson::array();
        for (const TuneSetting& setting : settings[i]) {
            // A response is named once, with all its generators.
            const auto same = std::find_if(responses.begin(), responses.end(), [&setting](const OrderedJson& one) {
                return one.at("method") == setting.response;
            });
            if (same != responses.end()) {
                same->at("contacts").push_back(setting.contacts);
            } else {
                responses.push_back({{"method", setting.response}, {"contacts", {setting.contacts}}});
            }
        }
        OrderedJson experiment{{"frames", "closed_loop"},
                               {"scenes", scenes},
                               {"detectors", {tune.detector}},
                               {"responses", std::move(responses)},
                               {"contacts", tune.responses[i].contacts},
                               {"detail_stride", 1'000'000}};
        if (!tune.responses[i].stepper.empty()) experiment["steppers"] = {tune.responses[i].stepper};
        experiments.push_back(std::move(experiment));
    }
    return OrderedJson{{"format", "trocar-study-3"},
                       {"name", fmt::format("{}_stage_{}", tune.name, stage)},
                       {"seed", tune.seed},
                       {"repetitions", 1},
                       {"time_limit_s", tune.time_limit_s},
                       {"experiments", std::move(experiments)}}
               .dump(1) +
           "\n";
}

bool TuneResult::converged() const {
    const auto [least, largest] = std::minmax_element(by_start.begin(), by_start.end());
    return least->broken == largest->broken && largest->objective - least->objective <= std::log(1.05);
}

std::string tuned_text(const Tune& tune, const std::vector<TuneResult>& results) {
    OrderedJson list = OrderedJson::array();
    for (const TuneResult& result : results) {
        OrderedJson starts = OrderedJson::array();
        for (const TuneScore& score : result.by_start) starts.push_back(score_json(score));
        list.push_back({{"method", result.method},
                        {"stepper", result.stepper},
                        {"setting", result.setting.response},
                        {"contacts", result.setting.contacts},
                        {"score", score_json(result.score)},
                        {"as_it_comes", score_json(result.as_it_comes)},
                        {"starts", std::move(starts)},
                        {"converged", result.converged()}});
    }
    OrderedJson limits = OrderedJson::object();
    for (const auto& [metric, most] : tune.limits) limits[std::string(info_of(metric).name)] = most;
    if (tune.force_step) {
        limits[std::string(info_of(Metric::force_jump_max_n).name)] =
            fmt::format("{} reference_force_step_hard + {} N", tune.force_step->times_reference, tune.force_step->plus);
    }
    return OrderedJson{{"format", tuned_format},
                       {"tune", tune.name},
                       {"seed", tune.seed},
                       {"objective", fmt::format("median over {} scenes of log(residual_penetration_max_m + {} m)",
                                                 tune.scenes.size(), tune.depth_offset)},
                       {"limits", std::move(limits)},
                       {"budget", {{"first", tune.first}, {"second", tune.second}, {"local", tune.local}}},
                       {"responses", std::move(list)}}
               .dump(1) +
           "\n";
}

}  // namespace trocar
