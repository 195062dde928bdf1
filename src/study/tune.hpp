// Search for the settings of responses, with one objective, one budget and two starts for all of them. Its stages are
// ordinary studies of closed loops, so that an interrupted search resumes as a study does.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

/// Range of one parameter. A logarithmic one has positive ends.
struct TuneRange {
    std::string key;
    double from = 0.0;
    double to = 1.0;
    bool log = false;
};

struct TunedResponse {
    std::string method;                 ///< NAME[:key=value…], what stays fixed
    std::vector<std::string> contacts;  ///< generators to choose from
    std::string stepper;                ///< empty: the default one
    std::vector<TuneRange> ranges;
};

/// Largest change of the tool force from tick to tick, beside that of the stored reference with hard contact, also of
/// one that ends early. A scene whose hard reference is known to be absent has no such limit.
struct ForceStepLimit {
    double times_reference = 1.0;
    double plus = 0.0;  ///< N
};

/// Format of the file of tuned settings.
inline constexpr const char* tuned_format = "trocar-tuned-1";

/// At most this many parameters of a response are searched, its generator among them.
inline constexpr std::size_t most_tuned_parameters = 4;
inline constexpr int tune_starts = 2;
inline constexpr int local_rounds = 4;

struct Tune {
    std::filesystem::path file;
    std::string name;
    std::uint64_t seed = 1;
    double time_limit_s = 30.0;  ///< s, per run
    std::string detector;
    double depth_offset = 1.0e-4;              ///< m, added to depths before the logarithm: 0.02 mean edges
    std::map<Metric, double> limits;           ///< largest value on any scene, in the metric's unit
    std::optional<ForceStepLimit> force_step;  ///< the same, from the reference of each scene
    std::vector<std::string> scenes;           ///< relative to the file, or absolute
    std::size_t first_scenes = 4;              ///< so many of them, from the start, in the first stage
    std::size_t first = 64;                    ///< settings of the first stage, per response and start
    std::size_t second = 16;                   ///< the best of them, on all scenes
    std::size_t local = 32;                    ///< settings near the best, on all scenes, in four rounds
    std::vector<TunedResponse> responses;
};

/// Throws InputError with the JSON pointer, also for an empty range and for a parameter that the response lacks.
/// `shipped`: scenes by name.
Tune read_tune(const std::filesystem::path& file, const std::vector<std::filesystem::path>& shipped);

/// Point `index` of Sobol's sequence in [0, 1)^dimensions, at most four (Bratley and Fox 1988, direction numbers of Joe
/// and Kuo 2008).
std::vector<double> sobol_point(std::uint64_t index, std::size_t dimensions);

/// A response with values for its ranges, and a generator.
struct TuneSetting {
    std::string response;
    std::string contacts;
    auto operator<=>(const TuneSetting&) const = default;
};
/// `place`: in the unit cube, the ranges in their order, then the generator where there are several.
TuneSetting setting_at(const TunedResponse& response, const std::vector<double>& place);

/// Settings that fail or break a limit on a scene come after all that do not; then by the objective.
struct TuneScore {
    int broken = 0;  ///< scenes on which a run failed or a limit is broken
    double objective =
        0.0;  ///< median over the scenes of log(max residual penetration + depth_offset), infinite if failed
    auto operator<=>(const TuneScore&) const = default;
};
/// `records`: of one setting on its scenes, not empty.
TuneScore score_of(const Tune& tune, const std::vector<const Record*>& records);

/// Search of one response from one start. Each stage names settings and takes their scores.
class TuneSearch {
public:
    /// The start shifts the sequence (Cranley and Patterson 1976).
    TuneSearch(const Tune& tune, const TunedResponse& response, int start);
    static constexpr int stages = 2 + local_rounds;
    /// Settings of a stage. Precondition: all earlier ones have their scores.
    [[nodiscard]] std::vector<TuneSetting> settings(int stage) const;
    /// `scores`: in the order of settings(stage).
    void take_scores(int stage, const std::vector<TuneScore>& scores);

    struct Candidate {
        std::vector<double> place;
        TuneSetting setting;
        TuneScore score;
    };
    /// Least score of the stages on all scenes. Precondition: the second one has its scores.
    [[nodiscard]] const Candidate& best() const;

private:
    [[nodiscard]] std::vector<std::vector<double>> places(int stage) const;

    const Tune* tune_;
    const TunedResponse* response_;
    int start_;
    std::vector<Candidate> first_;  ///< by score
    std::vector<Candidate> all_;    ///< of the later stages, by score
};

/// Study file of a stage. `settings`: by response of the tune, without repetition.
std::string tune_stage_text(const Tune& tune, int stage, const std::vector<std::vector<TuneSetting>>& settings);

/// Outcome for one response.
struct TuneResult {
    std::string method;
    std::string stepper;
    TuneSetting setting;
    TuneScore score;
    TuneScore as_it_comes;  ///< the response with its defaults, on all scenes
    std::vector<TuneScore> by_start;
    /// The starts' objectives differ by at most 5 % in depth plus offset.
    [[nodiscard]] bool converged() const;
};

/// Text of the file of tuned settings; equal results give equal bytes.
std::string tuned_text(const Tune& tune, const std::vector<TuneResult>& results);

}  // namespace trocar
