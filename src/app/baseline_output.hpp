// What `trocar baseline` reports each answer: as text, as JSON and as a JUnit file.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "study/baseline_comparison.hpp"

namespace trocar::app {

/// A difference with names that a person knows.
struct NamedDifference {
    ContactDifference difference;
    std::array<std::string, 2> bodies;
    std::array<Index, 2> triangles{-1, -1};  ///< numbers in the file of a recording, of the topology of a scene
};

enum class FindingState {
    same,
    changed,
    no_worse,     ///< other frames than those kept, and by truth at least as good
    worse,        ///< likewise, and not as good
    not_kept,     ///< nothing is kept of this detector, so there is nothing to hold it against
    gone,         ///< contacts are kept, but this build or this recording has no such answer
    no_baseline,  ///< there is no file of kept contacts
    dropped       ///< `write`: contacts that were kept on other frames go
};
/// "same", "changed", …
const char* name_of(FindingState state);
/// What makes `check` end with status 1.
bool is_failure(FindingState state);

/// One answer.
struct BaselineFinding {
    std::string detector;  ///< NAME:key=value, or recorded
    FindingState state = FindingState::same;
    std::string reason;  ///< a sentence, of gone, no_baseline and dropped
    std::optional<std::string> outcome_kept;
    std::optional<std::string> outcome;
    std::optional<AnswerDifference> difference;  ///< from what is kept, on the same frames
    std::optional<TruthFigures> truth_kept;
    std::optional<TruthFigures> truth;
    std::vector<NamedDifference> worst;  ///< from what is kept where `difference` is, else from truth
};

/// One scene or recording.
struct BaselineReport {
    std::string source;
    std::filesystem::path file;  ///< of the contacts that are kept
    bool kept = false;           ///< it was there
    bool same_frames = false;    ///< as those whose contacts are kept
    std::vector<BaselineFinding> findings = {};
};

/// Lines for a terminal.
std::string baseline_text(const BaselineReport& report);
/// One document, a line.
std::string baseline_json(const std::vector<BaselineReport>& reports, bool written);
/// A test suite for each source and a case for each answer, as CI servers read it.
std::string baseline_junit(const std::vector<BaselineReport>& reports);

}  // namespace trocar::app
