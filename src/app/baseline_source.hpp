// Frames for `trocar baseline`, and the contacts on them from detectors and recordings.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/baseline_output.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "scene/scene.hpp"
#include "simulate/frame_source.hpp"
#include "study/baseline_comparison.hpp"
#include "study/contact_baseline.hpp"

namespace trocar::app {

/// A scene or recording as repeatable frames.
class BaselineSource {
public:
    /// Throws InputError for a missing or invalid file, malformed contacts, or no frames.
    BaselineSource(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);
    [[nodiscard]] std::unique_ptr<FrameSource> frames() const;
    /// Baseline with the hashes of this source and without contacts.
    [[nodiscard]] ContactBaseline empty_baseline(std::int64_t every) const;
    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::int64_t ticks() const { return ticks_; }
    /// Contacts of a recording; empty for a scene and for a recording without contacts.
    [[nodiscard]] const std::optional<std::vector<RecordedTick>>& recorded() const { return recorded_; }
    /// Adds body names and, for a recording, the triangle numbers of its file.
    [[nodiscard]] NamedDifference named(const ContactDifference& difference) const;

private:
    std::filesystem::path file_;
    std::unique_ptr<Scene> scene_;
    std::unique_ptr<RecordingReader> recording_;
    std::optional<std::vector<RecordedTick>> recorded_;
    std::string name_;
    std::string hash_;
    std::int64_t ticks_ = 0;
};

/// Contacts of a detector on every `stream.every`-th tick. It runs in a child process, so that a crash of a library
/// becomes an outcome.
BaselineAnswer ask_detector(const MethodSpec& method, const BaselineSource& source, const ContactBaseline& stream,
                            double time_limit_s);

/// Contacts of the recording on every `every`-th tick. Precondition: it has contacts.
BaselineAnswer recorded_as_answer(const BaselineSource& source, std::int64_t every);

/// Compares the pairs of all entries with the exact oracle, on their own ticks.
std::map<std::string, TruthComparison> hold_against_truth(const ContactBaseline& answers, const BaselineSource& source);

}  // namespace trocar::app
