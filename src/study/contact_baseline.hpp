// Stored contacts on the frames of a scene or recording, from detectors or from the recording itself. They show when a
// change of code changes the contacts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"

namespace trocar {

/// Contacts of one detector on one sampled tick; ticks without a contact are omitted.
struct BaselineTick {
    std::int64_t tick = 0;
    std::vector<Contact> contacts;  ///< fields stored: kind, a, b, point, normal, depth
};

/// Agreement of triangle pairs with the exact oracle, summed over the examined ticks.
struct TruthFigures {
    std::int64_t ticks = 0;  ///< with known pairs and a finite frame
    std::int64_t pairs = 0;  ///< of the oracle
    std::int64_t reported =
        0;  ///< reported pairs; those with a negative depth count only where the triangles intersect
    std::int64_t false_negatives = 0;        ///< false negatives: of `pairs`, not reported
    std::int64_t false_negatives_touch = 0;  ///< of `false_negatives`, those that only touch
    std::int64_t false_positives = 0;        ///< false positives: of `reported`, those that do not intersect
    bool operator==(const TruthFigures&) const = default;
};

struct BaselineAnswer {
    std::string outcome = "ok";  ///< name of the first outcome that is not ok
    std::vector<BaselineTick> ticks;
    std::optional<std::int64_t> every = {};  ///< set where it differs from ContactBaseline::every
    std::optional<TruthFigures> truth = {};  ///< empty in a file of format 1
};

/// Key of the contacts stored in a recording, beside the detector names.
inline constexpr const char* recorded_answer = "recorded";

struct ContactBaseline {
    std::string source;       ///< name of the scene or recording
    std::string source_hash;  ///< of the generator's content, 16 hex digits
    std::string frames_hash;  ///< over all frames, 16 hex digits; contacts are compared only when it is equal
    std::int64_t ticks = 0;   ///< frames of the stream
    std::int64_t every = 1;   ///< contacts are stored on ticks 0, every, 2 every …
    std::map<std::string, BaselineAnswer> detectors = {};
    /// Precondition: `name` is a key of `detectors`.
    [[nodiscard]] std::int64_t every_of(const std::string& name) const {
        return detectors.at(name).every.value_or(every);
    }
};

/// One JSON document (trocar-baseline-3); detectors with the same answer share it. Lengths in m, to 1e-12; normals to
/// 1e-12.
std::string to_json(const ContactBaseline& baseline);
/// Reads format 1 or 2. Throws InputError for a missing file, another format, wrong types or counts.
ContactBaseline read_contact_baseline(const std::filesystem::path& file);
/// `name`: file name for error messages.
ContactBaseline contact_baseline_from_json(const std::string& text, const std::string& name);
/// JSON Schema, printed by `trocar schema baseline`.
std::string contact_baseline_schema();

/// Rounds to the precision of the file, so that unchanged contacts compare equal to stored ones.
void round_like_stored(BaselineAnswer& answer);

/// Name of a contact case in the file.
const char* stored_word(ContactCase kind);

}  // namespace trocar
