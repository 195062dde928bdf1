// The frames that `trocar baseline` works on and the answers to them: what detectors say and what a recording carries.
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

/// A scene or a recording as frames that can be had again and again.
class BaselineSource {
public:
    /// Throws InputError: no such file, a bad one, contacts that are malformed, no frames.
    BaselineSource(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data);
    [[nodiscard]] std::unique_ptr<FrameSource> frames() const;
    /// With the hashes of this source, and no answer.
    [[nodiscard]] ContactBaseline empty_baseline(std::int64_t every) const;
    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::int64_t ticks() const { return ticks_; }
    /// What a recording carries; none of a scene and of a recording without contacts.
    [[nodiscard]] const std::optional<std::vector<RecordedTick>>& recorded() const { return recorded_; }
    /// With the bodies' names; numbers as in the file of a recording.
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

/// What a detector says on every `stream.every`-th tick. It works in a process of its own, since a library may crash on
/// what it is given; that is an outcome then.
BaselineAnswer ask_detector(const MethodSpec& method, const BaselineSource& source, const ContactBaseline& stream,
                            double time_limit_s);

/// What the recording carries on every `every`-th tick. Precondition: it carries contacts.
BaselineAnswer recorded_as_answer(const BaselineSource& source, std::int64_t every);

/// Holds the pairs of every answer that has some against truth, on the ticks that it speaks of.
std::map<std::string, TruthComparison> hold_against_truth(const ContactBaseline& answers, const BaselineSource& source);

}  // namespace trocar::app
