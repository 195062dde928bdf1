// Output of `trocar baseline`: text, JSON and JUnit.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "study/baseline_comparison.hpp"

namespace trocar::app {

/// A difference with body names.
struct NamedDifference {
    ContactDifference difference;
    std::array<std::string, 2> bodies;
    std::array<Index, 2> triangles{-1, -1};  ///< numbers in the recording's file, or of the scene's topology
};

enum class FindingState {
    same,
    changed,
    no_worse,     ///< other frames than stored, and no worse against the oracle
    worse,        ///< other frames than stored, and worse against the oracle
    not_kept,     ///< no stored contacts of this detector
    gone,         ///< contacts are stored, but this build or recording lacks the method
    no_baseline,  ///< no baseline file
    dropped       ///< `write`: stored contacts of other frames are deleted
};
const char* name_of(FindingState state);
/// True when `check` must exit with status 1.
bool is_failure(FindingState state);

/// Result for one detector or recording.
struct BaselineFinding {
    std::string detector;  ///< NAME:key=value, or recorded
    FindingState state = FindingState::same;
    std::string reason;  ///< a sentence, for gone, no_baseline and dropped
    std::optional<std::string> outcome_kept;
    std::optional<std::string> outcome;
    std::optional<AnswerDifference> difference;  ///< from the stored contacts, on equal frames
    std::optional<TruthFigures> truth_kept;
    std::optional<TruthFigures> truth;
    std::vector<NamedDifference> worst;  ///< relative to the stored contacts if `difference` is set, else to the oracle
};

/// Results for one scene or recording.
struct BaselineReport {
    std::string source;
    std::filesystem::path file;  ///< baseline file
    bool kept = false;           ///< the baseline file exists
    bool same_frames = false;    ///< the frames equal those of the baseline
    std::vector<BaselineFinding> findings = {};
};

std::string baseline_text(const BaselineReport& report);
/// One JSON document on one line.
std::string baseline_json(const std::vector<BaselineReport>& reports, bool written);
/// JUnit XML: one test suite per source, one case per finding.
std::string baseline_junit(const std::vector<BaselineReport>& reports);

}  // namespace trocar::app
