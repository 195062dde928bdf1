#include "study/contact_baseline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"

namespace trocar {
namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr const char* baseline_format = "trocar-baseline-1";
constexpr std::array<const char*, 7> kind_names{"unset", "a_enters_b", "b_enters_a", "edges_cross",
                                                "touch", "coplanar",   "degenerate"};
constexpr std::size_t contact_numbers = 10;  // a, b, point, normal, depth without the kind

/// To 1e-12: far below any length or normal that means something, and the same text on every read and write.
double rounded(double value) {
    if (!std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
    constexpr double step = 1.0e12;
    const double result = std::round(value * step) / step;
    return std::abs(value) > 1.0e3 ? value : result + 0.0;
}

OrderedJson number(double value) { return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr); }

OrderedJson contact_json(const Contact& contact) {
    OrderedJson json{contact.a, contact.b, kind_names.at(static_cast<std::size_t>(contact.kind))};
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

Contact read_contact(const JsonNode& node) {
    const std::vector<JsonNode> items = node.list();
    if (items.size() != contact_numbers) node.fail(fmt::format("{} entries", contact_numbers));
    constexpr std::int64_t most = std::numeric_limits<Index>::max();
    const auto value = [&items](std::size_t i) { return items[i].is_null() ? Contact::unset : items[i].number(); };
    Contact contact;
    contact.a = static_cast<Index>(items[0].integer(0, most));
    contact.b = static_cast<Index>(items[1].integer(0, most));
    const std::string kind = items[2].word({kind_names.begin(), kind_names.end()});
    contact.kind = static_cast<ContactCase>(std::find(kind_names.begin(), kind_names.end(), kind) - kind_names.begin());
    contact.point = {value(3), value(4), value(5)};
    contact.normal = {value(6), value(7), value(8)};
    contact.depth = value(9);
    return contact;
}

double gap(double before, double after) {
    if (std::isnan(before) && std::isnan(after)) return 0.0;
    const double size = std::abs(after - before);
    return std::isnan(size) ? HUGE_VAL : size;
}

double length_between(const Vector3& before, const Vector3& after) {
    double squares = 0.0;
    for (int i = 0; i < 3; ++i) squares += std::pow(gap(before[i], after[i]), 2);
    return std::sqrt(squares);
}

/// rad, from the chord, which keeps its digits where the cosine loses them.
double angle_between(const Vector3& before, const Vector3& after) {
    const double chord = length_between(before, after);
    return std::isinf(chord) ? HUGE_VAL : 2.0 * std::asin(std::min(1.0, chord / 2.0));
}

std::string told(const Contact& contact) {
    return fmt::format("{} depth {:.9g} m at ({:.9g}, {:.9g}, {:.9g}) m",
                       kind_names.at(static_cast<std::size_t>(contact.kind)), contact.depth, contact.point.x(),
                       contact.point.y(), contact.point.z());
}

class Comparison {
public:
    explicit Comparison(const BaselineTolerance& tolerance) : tolerance_(tolerance) {}

    /// Null: there is none.
    void add(std::int64_t tick, const Contact* before, const Contact* after) {
        if (before == nullptr && after == nullptr) return;
        const Contact& any = before != nullptr ? *before : *after;
        const auto example = [&] {
            return fmt::format("tick {}, triangles {} and {}: {} -> {}", tick, any.a, any.b,
                               before == nullptr ? "none" : told(*before), after == nullptr ? "none" : told(*after));
        };
        if (before == nullptr || after == nullptr) {
            (before == nullptr ? found.extra : found.missing) += 1;
            if (!lost_told_) found.example = example();
            lost_told_ = true;
            return;
        }
        ++found.compared;
        if (before->kind != after->kind) ++found.other_kind;
        const double depth = gap(before->depth, after->depth);
        const double point = length_between(before->point, after->point);
        const double angle = angle_between(before->normal, after->normal);
        found.worst_depth = std::max(found.worst_depth, depth);
        found.worst_point = std::max(found.worst_point, point);
        found.worst_angle = std::max(found.worst_angle, angle);
        const double badness = std::max({depth / tolerance_.length, point / tolerance_.length, angle / tolerance_.angle,
                                         before->kind != after->kind ? 2.0 : 0.0});
        if (!lost_told_ && badness > 1.0 && badness > worst_badness_) {
            worst_badness_ = badness;
            found.example = example();
        }
    }

    AnswerDifference found;

private:
    BaselineTolerance tolerance_;
    bool lost_told_ = false;
    double worst_badness_ = 0.0;
};

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

std::string to_json(const ContactBaseline& baseline) {
    OrderedJson sets = OrderedJson::array();
    OrderedJson detectors = OrderedJson::object();
    for (const auto& [name, answer] : baseline.detectors) {
        const OrderedJson ticks = ticks_json(answer);
        const auto same = std::find(sets.begin(), sets.end(), ticks);
        const auto position = same - sets.begin();
        if (same == sets.end()) sets.push_back(ticks);
        detectors[name] = {{"outcome", answer.outcome}, {"contacts", position}};
    }
    // One line per tick, so that a change of the file can be read.
    std::string text = fmt::format(
        "{{\n\"format\": \"{}\",\n\"source\": {},\n\"source_hash\": \"{}\",\n\"frames_hash\": \"{}\",\n\"ticks\": {},\n"
        "\"every\": {},\n\"detectors\": {},\n\"contacts\": [",
        baseline_format, OrderedJson(baseline.source).dump(), baseline.source_hash, baseline.frames_hash,
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
    root.at("format").expect_word(baseline_format);
    ContactBaseline baseline;
    baseline.source = root.at("source").text();
    baseline.source_hash = root.at("source_hash").text();
    baseline.frames_hash = root.at("frames_hash").text();
    constexpr std::int64_t most = 1'000'000'000'000;
    baseline.ticks = root.at("ticks").integer(1, most);
    baseline.every = root.at("every").integer(1, most);
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
        entry.expect_keys({"outcome", "contacts"});
        const JsonNode number = entry.at("contacts");
        const std::int64_t position = number.integer(0, most);
        if (position >= static_cast<std::int64_t>(answers.size())) number.fail("a position in /contacts");
        baseline.detectors[key] = {.outcome = entry.at("outcome").text(),
                                   .ticks = answers[static_cast<std::size_t>(position)]};
    }
    return baseline;
}

std::string contact_baseline_schema() {
    return R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "stored contacts, format trocar-baseline-1",
  "description": "What trocar baseline write keeps and trocar baseline check reads, one document per scene or recording. Contacts are canonical ones (trocar computes them from the pairs of triangles, the same way for every detector).",
  "type": "object", "additionalProperties": false,
  "required": ["format", "source", "source_hash", "frames_hash", "ticks", "every", "detectors", "contacts"],
  "properties": {
    "format": {"const": "trocar-baseline-1"},
    "source": {"type": "string", "description": "Name of the scene or recording"},
    "source_hash": {"type": "string", "description": "16 hex digits, of its content; another one makes the file stale"},
    "frames_hash": {"type": "string", "description": "16 hex digits, over all frames; another one makes the file stale"},
    "ticks": {"type": "integer", "minimum": 1, "description": "Frames of the stream"},
    "every": {"type": "integer", "minimum": 1, "description": "Contacts are kept on ticks 0, every, 2 every, ..."},
    "detectors": {"type": "object", "description": "Keys: NAME[:key=value,...]", "additionalProperties": {
      "type": "object", "additionalProperties": false, "required": ["outcome", "contacts"], "properties": {
        "outcome": {"type": "string", "description": "ok, or the first tick's that was not; truncated: a limit cut a list"},
        "contacts": {"type": "integer", "minimum": 0, "description": "Position in the list below; detectors with the same contacts share it"}}}},
    "contacts": {"type": "array", "items": {"type": "object", "description": "Keys: ticks with a contact", "additionalProperties": {
      "type": "array", "items": {"type": "array", "minItems": 10, "maxItems": 10,
        "description": "a, b (triangle numbers, a < b), kind, point x y z (m, world), unit normal x y z from a to b, depth (m, >= 0); null: not set"}}}}
  }
}
)";
}

bool AnswerDifference::within(const BaselineTolerance& tolerance) const {
    return missing == 0 && extra == 0 && other_kind == 0 && outcome.empty() && worst_depth <= tolerance.length &&
           worst_point <= tolerance.length && worst_angle <= tolerance.angle;
}

AnswerDifference compare_answers(const BaselineAnswer& before, const BaselineAnswer& after,
                                 const BaselineTolerance& tolerance) {
    Comparison comparison(tolerance);
    if (before.outcome != after.outcome) comparison.found.outcome = before.outcome + " -> " + after.outcome;
    using Key = std::tuple<std::int64_t, Index, Index>;
    std::map<Key, std::pair<const Contact*, const Contact*>> both;
    for (const BaselineTick& tick : before.ticks) {
        for (const Contact& contact : tick.contacts) both[{tick.tick, contact.a, contact.b}].first = &contact;
    }
    for (const BaselineTick& tick : after.ticks) {
        for (const Contact& contact : tick.contacts) both[{tick.tick, contact.a, contact.b}].second = &contact;
    }
    for (const auto& [key, pair] : both) comparison.add(std::get<0>(key), pair.first, pair.second);
    return comparison.found;
}

}  // namespace trocar
