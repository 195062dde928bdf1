#include "scene/recorded_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"

namespace trocar {
namespace {

constexpr const char* contacts_format = "trocar-contacts-1";
constexpr double most_off_unit = 1.0e-6;  // a normal computed in single precision is still one

const char* const unit_normal = "a normal of length 1, to 1e-6";

bool is_unit(const Vector3& normal) { return std::abs(normal.norm() - 1.0) <= most_off_unit; }

const BodyRange& body_of(const Topology& topology, Index triangle) {
    return topology.bodies[static_cast<std::size_t>(topology.body_of_triangle[static_cast<std::size_t>(triangle)])];
}

bool are_tested(const Topology& topology, Index body_a, Index body_b) {
    return topology.body_pair(std::min(body_a, body_b), std::max(body_a, body_b)) >= 0;
}

/// The smaller triangle first, as everywhere; the normal is then reversed.
RecordedContact in_order(RecordedContact contact) {
    if (contact.a > contact.b) {
        std::swap(contact.a, contact.b);
        contact.normal = -contact.normal;
    }
    return contact;
}

/// What a writer's caller has put together; the reader's complaints name places in the file instead.
class WriterCheck {
public:
    WriterCheck(const Topology& topology, const std::string& file, std::int64_t tick)
        : topology_(topology), file_(file), tick_(tick) {}

    void expect_usable(const RecordedContact& contact, std::size_t position) const {
        const auto fail = [&](std::string_view expected, const std::string& found) {
            throw InputError(file_, fmt::format("frame {}: contact {}", tick_, position), expected, found);
        };
        const Index count = topology_.triangle_count();
        for (const Index triangle : {contact.a, contact.b}) {
            if (triangle >= 0 && triangle < count) continue;
            fail(fmt::format("a triangle number below {}", count), std::to_string(triangle));
        }
        const Index body_a = topology_.body_of_triangle[static_cast<std::size_t>(contact.a)];
        const Index body_b = topology_.body_of_triangle[static_cast<std::size_t>(contact.b)];
        if (!are_tested(topology_, body_a, body_b)) {
            fail("two bodies that are tested against each other (body_pairs)",
                 fmt::format("'{}' and '{}'", body_of(topology_, contact.a).name, body_of(topology_, contact.b).name));
        }
        for (const auto& [what, vector] : {std::pair("point", contact.point), std::pair("normal", contact.normal)}) {
            if (vector.allFinite() || vector.array().isNaN().all()) continue;
            fail(fmt::format("a {} of three finite numbers, or of three NaN where it is not reported", what),
                 fmt::format("({}, {}, {})", vector.x(), vector.y(), vector.z()));
        }
        if (contact.normal.allFinite() && !is_unit(contact.normal)) {
            fail(unit_normal, fmt::format("{:.9g}", contact.normal.norm()));
        }
        if (std::isinf(contact.depth)) fail("a finite depth, or NaN where it is not reported", "infinity");
    }

private:
    const Topology& topology_;
    const std::string& file_;
    std::int64_t tick_;
};

/// Takes the lines apart.
class TextReader {
public:
    TextReader(std::istream& stream, const Topology& topology, const std::vector<Index>& triangle_of_file,
               std::string file)
        : stream_(stream), topology_(topology), triangle_of_file_(triangle_of_file), file_(std::move(file)) {
        for (Index body = 0; body < topology.body_count(); ++body) {
            bodies_[topology.bodies[static_cast<std::size_t>(body)].name] = body;
        }
    }

    std::vector<RecordedTick> read(std::int64_t frames) {
        const std::int64_t promised = read_head(frames);
        std::vector<RecordedTick> ticks;
        while (static_cast<std::int64_t>(ticks.size()) < promised) {
            const std::int64_t earliest = ticks.empty() ? 0 : ticks.back().tick + 1;
            if (!next_line()) {
                throw InputError(place_, "", fmt::format("{} lines of ticks after the first one", promised),
                                 fmt::format("{}", ticks.size()));
            }
            ticks.push_back(read_tick(earliest, frames));
        }
        if (next_line()) throw InputError(place_, "", "the end of the file", "another line");
        return ticks;
    }

private:
    /// False at the end of the file; a line without its end is none.
    bool next_line() {
        ++number_;
        place_ = fmt::format("{}: contacts line {}", file_, number_);
        if (!read_line(stream_, line_, place_)) return false;
        if (stream_.eof()) throw InputError(place_, "", "a line feed at its end", "the end of the file");
        return true;
    }

    /// A line is a document of one line, so that of a place in it only the column says something.
    [[nodiscard]] Json parsed_line() const {
        try {
            return parse_json(line_, place_);
        } catch (const InputError& error) {
            std::string message = error.what();
            const std::string only_line = place_ + ": line 1, column";
            if (message.starts_with(only_line)) message.replace(0, only_line.size(), place_ + ", column");
            throw InputError(message);
        }
    }

    std::int64_t read_head(std::int64_t frames) {
        if (!next_line()) {
            throw InputError(place_, "", fmt::format("a line with the format {}", contacts_format), "none");
        }
        const Json document = parsed_line();
        const JsonNode node(document, place_);
        node.expect_keys({"format", "ticks"});
        node.at("format").expect_word(contacts_format);
        return node.at("ticks").integer(0, frames);
    }

    RecordedTick read_tick(std::int64_t earliest, std::int64_t frames) {
        const Json document = parsed_line();
        const JsonNode node(document, place_);
        node.expect_keys({"tick", "contacts"});
        RecordedTick tick;
        const JsonNode number = node.at("tick");
        tick.tick = number.integer(0, std::max<std::int64_t>(frames - 1, 0));
        if (tick.tick < earliest) number.fail(fmt::format("a tick after the line before, {} at least", earliest));
        for (const JsonNode& item : node.at("contacts").list()) tick.contacts.push_back(read_contact(item));
        return tick;
    }

    RecordedContact read_contact(const JsonNode& node) const {
        node.expect_keys({"bodies", "triangles", "point", "normal", "depth"});
        const JsonNode bodies = node.at("bodies");
        const std::vector<JsonNode> names = bodies.list();
        if (names.size() != 2) bodies.fail("the names of two bodies");
        const Index first = body_named(names[0]);
        const Index second = body_named(names[1]);
        if (!are_tested(topology_, first, second)) {
            bodies.fail("two bodies that are tested against each other (body_pairs)");
        }
        const JsonNode triangles = node.at("triangles");
        const std::vector<JsonNode> numbers = triangles.list();
        if (numbers.size() != 2) triangles.fail("the numbers of two triangles");
        RecordedContact contact;
        contact.a = triangle_in(numbers[0], first);
        contact.b = triangle_in(numbers[1], second);
        if (const auto point = node.find("point")) contact.point = point->vector3();
        if (const auto normal = node.find("normal")) {
            contact.normal = normal->vector3();
            if (!is_unit(contact.normal)) normal->fail(unit_normal, fmt::format("{:.9g}", contact.normal.norm()));
        }
        if (const auto depth = node.find("depth")) contact.depth = depth->number();
        return in_order(contact);
    }

    [[nodiscard]] Index body_named(const JsonNode& node) const {
        const auto found = bodies_.find(node.text());
        if (found == bodies_.end()) node.fail("the name of a body of the recording");
        return found->second;
    }

    /// Its number in the topology.
    [[nodiscard]] Index triangle_in(const JsonNode& node, Index body) const {
        const BodyRange& range = topology_.bodies[static_cast<std::size_t>(body)];
        const std::int64_t number = node.integer(0, std::max<std::int64_t>(topology_.triangle_count() - 1, 0));
        Index triangle = static_cast<Index>(number);
        if (!triangle_of_file_.empty()) triangle = triangle_of_file_[static_cast<std::size_t>(number)];
        if (range.triangles.contains(triangle)) return triangle;
        node.fail(triangle_of_file_.empty() && range.triangles.count > 0
                      ? fmt::format("a triangle of body '{}' ({} to {})", range.name, range.triangles.first,
                                    range.triangles.end() - 1)
                      : fmt::format("a triangle of body '{}'", range.name));
    }

    std::istream& stream_;
    const Topology& topology_;
    const std::vector<Index>& triangle_of_file_;
    std::string file_;
    std::map<std::string, Index> bodies_;  ///< by name
    std::int64_t number_ = 0;
    std::string line_;
    std::string place_;
};

}  // namespace

std::string recorded_contacts_head(std::int64_t ticks) {
    return nlohmann::ordered_json{{"format", contacts_format}, {"ticks", ticks}}.dump() + "\n";
}

std::string recorded_tick_line(const Topology& topology, const RecordedTick& tick, const std::string& file) {
    const WriterCheck check(topology, file, tick.tick);
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < tick.contacts.size(); ++i) {
        const RecordedContact& contact = tick.contacts[i];
        check.expect_usable(contact, i);
        nlohmann::ordered_json item{{"bodies", {body_of(topology, contact.a).name, body_of(topology, contact.b).name}},
                                    {"triangles", {contact.a, contact.b}}};
        const auto numbers = [](const Vector3& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
        if (contact.point.allFinite()) item["point"] = numbers(contact.point);
        if (contact.normal.allFinite()) item["normal"] = numbers(contact.normal);
        if (std::isfinite(contact.depth)) item["depth"] = contact.depth;
        list.push_back(std::move(item));
    }
    return nlohmann::ordered_json{{"tick", tick.tick}, {"contacts", std::move(list)}}.dump() + "\n";
}

std::vector<RecordedTick> read_recorded_contacts(std::istream& stream, const Topology& topology,
                                                 const std::vector<Index>& triangle_of_file, std::int64_t frames,
                                                 const std::string& file) {
    return TextReader(stream, topology, triangle_of_file, file).read(frames);
}

}  // namespace trocar
