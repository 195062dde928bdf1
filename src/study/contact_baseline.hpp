// Contacts on a scene's or a recording's frames, those of detectors and those that a recording carries, kept in a file,
// so that a simulator's authors see when a change of code changes their contacts.
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

/// How pairs of triangles agree with exact truth, summed over the ticks that were examined.
struct TruthFigures {
    std::int64_t ticks = 0;     ///< whose pairs are known and whose frame is finite
    std::int64_t pairs = 0;     ///< that truly meet
    std::int64_t reported = 0;  ///< pairs of the answer; those made to be apart (depth below 0) only where they meet
    std::int64_t false_negatives = 0;        ///< of `pairs`, not reported
    std::int64_t false_negatives_touch = 0;  ///< of `false_negatives`, those that only touch
    std::int64_t false_positives = 0;        ///< of `reported`, those that do not meet
    bool operator==(const TruthFigures&) const = default;
};

struct BaselineAnswer {
    std::string outcome = "ok";  ///< the first that was not ok, by its name
    std::vector<BaselineTick> ticks;
    std::optional<std::int64_t> every = {};  ///< where another one than the document's
    std::optional<TruthFigures> truth = {};  ///< none in a file of format 1
};

/// The name that contacts carried by a recording have among those of detectors.
inline constexpr const char* recorded_answer = "recorded";

struct ContactBaseline {
    std::string source;       ///< name of the scene or recording
    std::string source_hash;  ///< of its content, 16 hex digits
    std::string frames_hash;  ///< over all frames, 16 hex digits: the same frames or no comparison
    std::int64_t ticks = 0;   ///< frames of the stream
    std::int64_t every = 1;   ///< contacts are kept on ticks 0, every, 2 every …
    std::map<std::string, BaselineAnswer> detectors = {};
    /// Of an answer that it has.
    [[nodiscard]] std::int64_t every_of(const std::string& name) const {
        return detectors.at(name).every.value_or(every);
    }
};

/// One JSON document (trocar-baseline-3); detectors with the same answer share it. Lengths in m, to 1e-12; normals to
/// 1e-12.
std::string to_json(const ContactBaseline& baseline);
/// Format 1 or 2. Throws InputError: no such file, not this format, wrong types or counts.
ContactBaseline read_contact_baseline(const std::filesystem::path& file);
/// From the text itself; `name` stands in complaints.
ContactBaseline contact_baseline_from_json(const std::string& text, const std::string& name);
/// JSON Schema document printed by `trocar schema baseline`.
std::string contact_baseline_schema();

/// Rounds to what the file keeps, so that fresh contacts and stored ones are equal when nothing has changed.
void round_like_stored(BaselineAnswer& answer);

/// The word of the file for a contact's case.
const char* stored_word(ContactCase kind);

}  // namespace trocar
