#include "study/contact_baseline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"

namespace trocar {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// The second adds truth; the third renames its keys.
const std::vector<std::string> baseline_formats{"trocar-baseline-1", "trocar-baseline-2", "trocar-baseline-3"};
constexpr std::int64_t most_stored = 1'000'000'000'000;  // of anything that is counted
constexpr std::size_t contact_numbers = 10;              // a, b, point, normal, depth without the kind

/// To 1e-12: far below any length or normal that means something, and the same text on every read and write.
double rounded(double value) {
    if (!std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
    constexpr double step = 1.0e12;
    const double result = std::round(value * step) / step;
    return std::abs(value) > 1.0e3 ? value : result + 0.0;
}

OrderedJson number(double value) { return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr); }

OrderedJson contact_json(const Contact& contact) {
    OrderedJson json{contact.a, contact.b, stored_word(contact.kind)};
    for (const double value : {contact.point.x(), contact.point.y(), contact.point.z(), contact.normal.x(),
                               contact.normal.y(), contact.normal.z(), contact.depth}) {
        json.push_back(number(value));
    }
    return json;
}

OrderedJson ticks_json(const BaselineAnswer& answer) {
    OrderedJson json = OrderedJson::object();
    for (const BaselineTick& tick : answer.ticks) {
        OrderedJson contacts = OrderedJson::array();
        for (const Contact& contact : tick.contacts) contacts.push_back(contact_json(contact));
        json[std::to_string(tick.tick)] = std::move(contacts);
    }
    return json;
}

OrderedJson truth_json(const TruthFigures& truth) {
    return {{"ticks", truth.ticks},
            {"pairs", truth.pairs},
            {"reported", truth.reported},
            {"false_negatives", truth.false_negatives},
            {"false_negatives_touch", truth.false_negatives_touch},
            {"false_positives", truth.false_positives}};
}

/// Keys of truth in one format, in the order of TruthFigures.
using TruthKeys = std::array<const char*, 6>;
constexpr TruthKeys truth_keys{"ticks",          "pairs", "reported", "false_negatives", "false_negatives_touch",
                               "false_positives"};
constexpr TruthKeys truth_keys_of_format_2{"ticks", "pairs", "told", "missing", "missing_touch", "extra"};

TruthFigures read_truth(const JsonNode& node, const TruthKeys& keys) {
    node.expect_keys({keys.begin(), keys.end()});
    const auto count = [&](std::size_t k) { return node.at(keys.at(k)).integer(0, most_stored); };
    return {.ticks = count(0),
            .pairs = count(1),
            .reported = count(2),
            .false_negatives = count(3),
            .false_negatives_touch = count(4),
            .false_positives = count(5)};
}

Contact read_contact(const JsonNode& node) {
    const std::vector<JsonNode> items = node.list();
    if (items.size() != contact_numbers) node.fail(fmt::format("{} entries", contact_numbers));
    constexpr std::int64_t most = std::numeric_limits<Index>::max();
    const auto value = [&items](std::size_t i) { return items[i].is_null() ? Contact::unset : items[i].number(); };
    Contact contact;
    contact.a = static_cast<Index>(items[0].integer(0, most));
    contact.b = static_cast<Index>(items[1].integer(0, most));
    const std::string kind = items[2].word({contact_case_words.begin(), contact_case_words.end()});
    contact.kind = static_cast<ContactCase>(std::find(contact_case_words.begin(), contact_case_words.end(), kind) -
                                            contact_case_words.begin());
    contact.point = {value(3), value(4), value(5)};
    contact.normal = {value(6), value(7), value(8)};
    contact.depth = value(9);
    return contact;
}

}  // namespace

void round_like_stored(BaselineAnswer& answer) {
    for (BaselineTick& tick : answer.ticks) {
        for (Contact& contact : tick.contacts) {
            contact.point = contact.point.unaryExpr(&rounded);
            contact.normal = contact.normal.unaryExpr(&rounded);
            contact.depth = rounded(contact.depth);
        }
    }
}

const char* stored_word(ContactCase kind) { return contact_case_words.at(static_cast<std::size_t>(kind)); }

std::string to_json(const ContactBaseline& baseline) {
    OrderedJson sets = OrderedJson::array();
    OrderedJson detectors = OrderedJson::object();
    for (const auto& [name, answer] : baseline.detectors) {
        const OrderedJson ticks = ticks_json(answer);
        const auto same = std::find(sets.begin(), sets.end(), ticks);
        const auto position = same - sets.begin();
        if (same == sets.end()) sets.push_back(ticks);
        OrderedJson& entry = detectors[name];
        entry = {{"outcome", answer.outcome}, {"contacts", position}};
        if (answer.every) entry["every"] = *answer.every;
        if (answer.truth) entry["truth"] = truth_json(*answer.truth);
    }
    // One line per tick, so that a change of the file can be read.
    std::string text = fmt::format(
        "{{\n\"format\": \"{}\",\n\"source\": {},\n\"source_hash\": \"{}\",\n\"frames_hash\": \"{}\",\n\"ticks\": {},\n"
        "\"every\": {},\n\"detectors\": {},\n\"contacts\": [",
        baseline_formats.back(), OrderedJson(baseline.source).dump(), baseline.source_hash, baseline.frames_hash,
        baseline.ticks, baseline.every, detectors.dump());
    for (std::size_t i = 0; i < sets.size(); ++i) {
        text += i == 0 ? "\n{" : ",\n{";
        bool first = true;
        for (const auto& [tick, contacts] : sets[i].items()) {
            text += fmt::format("{}\n\"{}\": {}", first ? "" : ",", tick, contacts.dump());
            first = false;
        }
        text += "}";
    }
    return text + "]\n}\n";
}

ContactBaseline read_contact_baseline(const std::filesystem::path& file) {
    return contact_baseline_from_json(read_whole(file, "stored contacts (trocar baseline write)"), file.string());
}

ContactBaseline contact_baseline_from_json(const std::string& text, const std::string& name) {
    const Json document = parse_json(text, name);
    const JsonNode root(document, name);
    root.expect_keys({"format", "source", "source_hash", "frames_hash", "ticks", "every", "detectors", "contacts"});
    const std::string format = root.at("format").word(baseline_formats);
    const bool has_truth = format != baseline_formats.front();
    const TruthKeys& keys_of_truth = format == baseline_formats.back() ? truth_keys : truth_keys_of_format_2;
    ContactBaseline baseline;
    baseline.source = root.at("source").text();
    baseline.source_hash = root.at("source_hash").text();
    baseline.frames_hash = root.at("frames_hash").text();
    baseline.ticks = root.at("ticks").integer(1, most_stored);
    baseline.every = root.at("every").integer(1, most_stored);
    const std::vector<JsonNode> sets = root.at("contacts").list();
    std::vector<std::vector<BaselineTick>> answers(sets.size());
    for (std::size_t i = 0; i < sets.size(); ++i) {
        for (const std::string& key : sets[i].keys()) {
            const JsonNode entry = sets[i].at(key);
            if (key.empty() || key.size() > 12 || key.find_first_not_of("0123456789") != std::string::npos) {
                entry.fail("a tick as key", "'" + key + "'");
            }
            BaselineTick tick;
            tick.tick = std::stoll(key);
            for (const JsonNode& contact : entry.list()) tick.contacts.push_back(read_contact(contact));
            answers[i].push_back(std::move(tick));
        }
        std::sort(answers[i].begin(), answers[i].end(),
                  [](const BaselineTick& a, const BaselineTick& b) { return a.tick < b.tick; });
    }
    const JsonNode detectors = root.at("detectors");
    for (const std::string& key : detectors.keys()) {
        const JsonNode entry = detectors.at(key);
        entry.expect_keys(has_truth ? std::vector<std::string>{"outcome", "contacts", "every", "truth"}
                                    : std::vector<std::string>{"outcome", "contacts"});
        const JsonNode number = entry.at("contacts");
        const std::int64_t position = number.integer(0, most_stored);
        if (position >= static_cast<std::int64_t>(answers.size())) number.fail("a position in /contacts");
        BaselineAnswer& answer = baseline.detectors[key];
        answer.outcome = entry.at("outcome").text();
        answer.ticks = answers[static_cast<std::size_t>(position)];
        if (const auto every = entry.find("every")) answer.every = every->integer(1, most_stored);
        if (const auto truth = entry.find("truth")) answer.truth = read_truth(*truth, keys_of_truth);
    }
    return baseline;
}

std::string contact_baseline_schema() {
    return R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "stored contacts, format trocar-baseline-3",
  "description": "What trocar baseline write keeps and trocar baseline check reads, one document per scene or recording. Contacts of detectors are intersection ones (trocar computes them from the pairs of triangles, the same way for every detector); those under the name recorded are the ones that the recording carries, as it reports them. Format 1 has neither every nor truth in an entry of detectors, and no recorded contacts. Format 2 names the keys of truth told, missing, missing_touch and extra.",
  "type": "object", "additionalProperties": false,
  "required": ["format", "source", "source_hash", "frames_hash", "ticks", "every", "detectors", "contacts"],
  "properties": {
    "format": {"enum": ["trocar-baseline-1", "trocar-baseline-2", "trocar-baseline-3"]},
    "source": {"type": "string", "description": "Name of the scene or recording"},
    "source_hash": {"type": "string", "description": "16 hex digits, of its content; another one: other frames"},
    "frames_hash": {"type": "string", "description": "16 hex digits, over all frames; another one: other frames, on which pairs are held against exact truth alone"},
    "ticks": {"type": "integer", "minimum": 1, "description": "Frames of the stream"},
    "every": {"type": "integer", "minimum": 1, "description": "Contacts are kept on ticks 0, every, 2 every, ..."},
    "detectors": {"type": "object", "description": "Keys: NAME[:key=value,...], or recorded", "additionalProperties": {
      "type": "object", "additionalProperties": false, "required": ["outcome", "contacts"], "properties": {
        "outcome": {"type": "string", "description": "ok, or the first tick's that was not; truncated: a limit cut a list"},
        "contacts": {"type": "integer", "minimum": 0, "description": "Position in the list below; detectors with the same contacts share it"},
        "every": {"type": "integer", "minimum": 1, "description": "Where it is another one than the document's"},
        "truth": {"$ref": "#/$defs/truth"}}}},
    "contacts": {"type": "array", "items": {"type": "object", "description": "Keys: ticks with a contact", "additionalProperties": {
      "type": "array", "items": {"type": "array", "minItems": 10, "maxItems": 10,
        "description": "a, b (triangle numbers, a < b), kind, point x y z (m, world), unit normal x y z from a to b, depth (m, positive inside); null: not set"}}}}
  },
  "$defs": {
    "truth": {"type": "object", "additionalProperties": false, "description": "Pairs of triangles held against exact truth, over all ticks examined",
      "required": ["ticks", "pairs", "reported", "false_negatives", "false_negatives_touch", "false_positives"], "properties": {
        "ticks": {"type": "integer", "minimum": 0, "description": "Whose pairs are known and whose frame is finite"},
        "pairs": {"type": "integer", "minimum": 0, "description": "That truly meet"},
        "reported": {"type": "integer", "minimum": 0, "description": "Of the answer; those reported apart (depth below 0) only where they meet"},
        "false_negatives": {"type": "integer", "minimum": 0, "description": "True pairs that were not reported"},
        "false_negatives_touch": {"type": "integer", "minimum": 0, "description": "Those of false_negatives that only touch"},
        "false_positives": {"type": "integer", "minimum": 0, "description": "Reported pairs that do not meet"}}}
  }
}
)";
}

}  // namespace trocar
