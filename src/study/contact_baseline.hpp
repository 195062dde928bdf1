// Canonical contacts of detectors on a scene's or a recording's frames, kept in a file, so that a simulator's authors
// see when a change of code changes their contacts. Missing, extra and stale baselines are failures, and contacts are
// compared one by one: a mean would hide the one that went wrong.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"

namespace trocar {

/// What one detector said on the sampled ticks; ticks without a contact are left out.
struct BaselineTick {
    std::int64_t tick = 0;
    std::vector<Contact> contacts;  ///< kind, a, b, point, normal, depth; the rest is not kept
};
struct BaselineAnswer {
    std::string outcome = "ok";  ///< the first that was not ok, by its name
    std::vector<BaselineTick> ticks;
};

struct ContactBaseline {
    std::string source;       ///< name of the scene or recording
    std::string source_hash;  ///< of its content, 16 hex digits
    std::string frames_hash;  ///< over all frames, 16 hex digits: the same frames or no comparison
    std::int64_t ticks = 0;   ///< frames of the stream
    std::int64_t every = 1;   ///< contacts are kept on ticks 0, every, 2 every …
    std::map<std::string, BaselineAnswer> detectors = {};
};

/// One JSON document (trocar-baseline-1); detectors with the same answer share it. Lengths in m, to 1e-12; normals to
/// 1e-12.
std::string to_json(const ContactBaseline& baseline);
/// Throws InputError: no such file, not this format, wrong types or counts.
ContactBaseline read_contact_baseline(const std::filesystem::path& file);
/// From the text itself; `name` stands in complaints.
ContactBaseline contact_baseline_from_json(const std::string& text, const std::string& name);
/// JSON Schema document printed by `trocar schema baseline`.
std::string contact_baseline_schema();

/// Rounds to what the file keeps, so that fresh contacts and stored ones are equal when nothing has changed.
void round_like_stored(BaselineAnswer& answer);

struct BaselineTolerance {
    double length = 1.0e-9;  ///< m, for depths and points
    double angle = 1.0e-6;   ///< rad, for normals
};

struct AnswerDifference {
    std::int64_t compared = 0;  ///< contacts that both have
    std::int64_t missing = 0;   ///< contacts of the baseline that are gone
    std::int64_t extra = 0;     ///< contacts that the baseline does not have
    std::int64_t other_kind = 0;
    double worst_depth = 0.0;  ///< m, largest of any contact; infinite where only one of the two is a number
    double worst_point = 0.0;  ///< m
    double worst_angle = 0.0;  ///< rad
    std::string outcome;       ///< "ok -> crashed"; empty: the same
    /// The first contact that is gone or new, else the worst one: "tick 40, triangles 3 and 17: depth 0.1 mm -> …".
    std::string example;
    [[nodiscard]] bool within(const BaselineTolerance& tolerance) const;
};
AnswerDifference compare_answers(const BaselineAnswer& before, const BaselineAnswer& after,
                                 const BaselineTolerance& tolerance);

}  // namespace trocar
