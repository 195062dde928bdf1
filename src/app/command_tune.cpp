// `trocar tune`: the best setting of every response that one search finds, the same for all. Its stages are studies in
// the output folder; each resumes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "app/commands.hpp"
#include "app/shipped.hpp"
#include "app/study_runs.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "reference/reference.hpp"
#include "report/report.hpp"
#include "study/tune.hpp"

namespace trocar::app {
namespace {

using Scores = std::map<TuneSetting, TuneScore>;

/// The response with its defaults, on the first of its generators.
TuneSetting as_it_comes(const TunedResponse& response) {
    return {.response = response.method, .contacts = response.contacts.front()};
}

/// Hashes of the scenes whose hard reference limits force steps. Throws InputError where one is neither stored nor said
/// to be absent.
std::set<std::string> scenes_with_reference(const Tune& tune, const CommonOptions& common) {
    std::set<std::string> hashes;
    if (!tune.force_step) return hashes;
    for (const std::string& scene : tune.scenes) {
        const FoundReference found = find_reference(read_scene(scene, common.data));
        if (found.state != ReferenceState::present) {
            throw InputError(scene, "", "a stored reference, which force_step_limit needs (`trocar reference SCENE`)",
                             found.reference.hard.reason);
        }
        if (found.reference.hard.available) hashes.insert(found.reference.scene_hash);
    }
    return hashes;
}

/// Scores of one stage, one map per response; empty when it was interrupted.
std::vector<Scores> run_stage(const Tune& tune, int stage, const std::vector<std::vector<TuneSetting>>& settings,
                              const std::set<std::string>& with_reference, const CommonOptions& common,
                              const TuneOptions& options) {
    const std::filesystem::path folder = options.output / fmt::format("stage_{}", stage);
    std::filesystem::create_directories(folder);
    StudyOptions stage_options;
    stage_options.file = folder / "study.json";
    stage_options.jobs = options.jobs;
    write_whole(stage_options.file, tune_stage_text(tune, stage, settings));
    const Study study = read_study(stage_options.file, {}, listed_scenes());
    const std::vector<PlannedRun> plan = completed_plan(study, common);
    if (run_study(study, plan, common, stage_options, folder, false).interrupted) return {};
    std::map<TuneSetting, std::map<std::string, std::vector<const Record*>>> runs;  // by setting and stepper
    const std::vector<Record> records = read_records(folder);
    for (const Record& record : records) {
        if (record.outcome.ok() && with_reference.contains(record.spec.scene_hash) &&
            std::isnan(value_of(record.summary, Metric::reference_force_step_hard))) {
            throw InputError(folder.string(), "", "runs made with the references of the scenes in place",
                             "older ones (--output names another folder)");
        }
        runs[{record.spec.response, record.spec.contacts}][record.spec.stepper].push_back(&record);
    }
    std::vector<Scores> scores(settings.size());
    for (std::size_t i = 0; i < settings.size(); ++i) {
        for (const TuneSetting& setting : settings[i]) {
            scores[i][setting] = score_of(tune, runs.at(setting).at(tune.responses[i].stepper));
        }
    }
    return scores;
}

std::string depth_text(const TuneScore& score, const Tune& tune) {
    const double depth = 1e3 * (std::exp(score.objective) - tune.depth_offset);
    return std::isfinite(depth) ? fmt::format("{:.3g} mm", depth) : std::string("fails");
}

}  // namespace

int tune(const CommonOptions& common, const TuneOptions& options) {
    const Tune tune = read_tune(options.file, listed_scenes());
    const std::set<std::string> with_reference = scenes_with_reference(tune, common);
    std::vector<TuneSearch> searches;  // starts of the first response, of the second one, ...
    for (const TunedResponse& response : tune.responses) {
        for (int start = 0; start < tune_starts; ++start) searches.emplace_back(tune, response, start);
    }
    std::vector<TuneScore> defaults(tune.responses.size());
    for (int stage = 0; stage < TuneSearch::stages; ++stage) {
        std::vector<std::vector<TuneSetting>> settings(tune.responses.size());
        for (std::size_t i = 0; i < searches.size(); ++i) {
            const std::vector<TuneSetting> wanted = searches[i].settings(stage);
            auto& of_response = settings[i / tune_starts];
            of_response.insert(of_response.end(), wanted.begin(), wanted.end());
        }
        for (std::size_t i = 0; i < settings.size(); ++i) {
            if (stage == 1) settings[i].push_back(as_it_comes(tune.responses[i]));
            std::sort(settings[i].begin(), settings[i].end());
            settings[i].erase(std::unique(settings[i].begin(), settings[i].end()), settings[i].end());
        }
        const std::vector<Scores> scores = run_stage(tune, stage, settings, with_reference, common, options);
        if (scores.empty()) {
            fmt::print(stderr, "trocar tune: interrupted in stage {} of {}; the same command goes on there\n", stage,
                       TuneSearch::stages);
            return interrupted;
        }
        for (std::size_t i = 0; i < searches.size(); ++i) {
            std::vector<TuneScore> of_stage;
            for (const TuneSetting& setting : searches[i].settings(stage)) {
                of_stage.push_back(scores[i / tune_starts].at(setting));
            }
            searches[i].take_scores(stage, of_stage);
        }
        if (stage != 1) continue;
        for (std::size_t i = 0; i < defaults.size(); ++i) {
            defaults[i] = scores[i].at(as_it_comes(tune.responses[i]));
        }
    }
    std::vector<TuneResult> results;
    for (std::size_t i = 0; i < tune.responses.size(); ++i) {
        const TunedResponse& response = tune.responses[i];
        TuneResult result{.method = response.method,
                          .stepper = response.stepper,
                          .setting = as_it_comes(response),
                          .score = defaults[i],
                          .as_it_comes = defaults[i],
                          .by_start = {}};
        for (int start = 0; start < tune_starts; ++start) {
            const TuneSearch::Candidate& best = searches[tune_starts * i + static_cast<std::size_t>(start)].best();
            result.by_start.push_back(best.score);
            if (best.score < result.score) {
                result.score = best.score;
                result.setting = best.setting;
            }
        }
        results.push_back(std::move(result));
    }
    const std::string text = tuned_text(tune, results);
    write_whole(options.output / "tuned.json", text);
    if (common.json) {
        fmt::print("{}", text);
        return done;
    }
    for (const TuneResult& result : results) {
        fmt::print("{} ({}): {}, broken on {} scenes; as it comes {}, {}; {}\n", result.setting.response,
                   result.setting.contacts, depth_text(result.score, tune), result.score.broken,
                   depth_text(result.as_it_comes, tune), result.as_it_comes.broken,
                   result.converged() ? "the starts agree" : "not converged");
    }
    fmt::print("Settings: {}\n", (options.output / "tuned.json").string());
    return done;
}

}  // namespace trocar::app
