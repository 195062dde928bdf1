// `trocar explain`: one tick of a scene in detail. The scene is driven to that tick, then every detector of this build
// answers on the very same frame, beside truth; one triangle pair can be examined in full.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "contact/derive.hpp"
#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"
#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "measure/depth_truth.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

/// Texts of numbers of the document, which hold null where nothing is given.
std::string vector_text(const Json& v, double scale) {
    const bool given = std::all_of(v.begin(), v.end(), [](const Json& x) { return x.is_number(); });
    if (!given) return "not given";
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", v[0].get<double>() * scale, v[1].get<double>() * scale,
                       v[2].get<double>() * scale);
}

std::string length_text(const Json& metres) {
    return metres.is_number() && std::isfinite(metres.get<double>())
               ? fmt::format("{:.6g} mm", metres.get<double>() * 1e3)
               : std::string("not given");
}

std::string three_in_mm(const Json& metres) {
    return fmt::format("{:.6g}, {:.6g}, {:.6g} mm", metres[0].get<double>() * 1e3, metres[1].get<double>() * 1e3,
                       metres[2].get<double>() * 1e3);
}

/// Triangles and vertices as a person knows them: body and number in the body's own file.
class Names {
public:
    explicit Names(const Scene& scene) : scene_(scene) {}
    [[nodiscard]] Index body_of(Index triangle) const { return scene_.topology.body_of_triangle[at(triangle)]; }
    [[nodiscard]] const std::string& body_name(Index body) const { return scene_.topology.bodies[at(body)].name; }
    [[nodiscard]] Index file_triangle(Index triangle) const {
        const Index body = body_of(triangle);
        const Index own = triangle - scene_.topology.bodies[at(body)].triangles.first;
        const std::vector<Index>& map = scene_.bodies[at(body)].file_triangle;
        return map.empty() ? own : map[at(own)];
    }
    [[nodiscard]] Index file_vertex(Index vertex) const {
        const Index body = scene_.topology.body_of_vertex(vertex);
        const Index own = vertex - scene_.topology.bodies[at(body)].vertices.first;
        const std::vector<Index>& map = scene_.bodies[at(body)].file_vertex;
        return map.empty() ? own : map[at(own)];
    }
    /// Number in the topology of triangle `number` of a body's file, -1 when there is none.
    [[nodiscard]] Index triangle(Index body, Index number) const {
        const Range range = scene_.topology.bodies[at(body)].triangles;
        for (Index t = range.first; t < range.end(); ++t) {
            if (file_triangle(t) == number) return t;
        }
        return -1;
    }
    [[nodiscard]] Json json(TrianglePair pair) const {
        return {{"bodies", {body_name(body_of(pair.a)), body_name(body_of(pair.b))}},
                {"triangles", {file_triangle(pair.a), file_triangle(pair.b)}}};
    }
    [[nodiscard]] Json vertex_json(Index vertex) const {
        return vertex < 0 ? Json(nullptr) : Json(file_vertex(vertex));
    }

private:
    const Scene& scene_;
};

struct ExplainedAnswer {
    std::string name;
    ContactSet contacts;
    std::vector<TrianglePair> false_negatives;
    std::vector<TrianglePair> false_positives;
};

std::vector<TrianglePair> difference(const std::vector<TrianglePair>& from, const std::vector<TrianglePair>& what) {
    std::vector<TrianglePair> rest;
    std::set_difference(from.begin(), from.end(), what.begin(), what.end(), std::back_inserter(rest));
    return rest;
}

/// Every detector of this build with its default settings on one frame.
std::vector<ExplainedAnswer> ask_all(const Topology& topology, const Frame& frame,
                                     const std::vector<TrianglePair>& truth) {
    std::vector<ExplainedAnswer> answers;
    for (const DetectorEntry& entry : registry().detectors()) {
        if (entry.control) continue;
        ExplainedAnswer answer;
        answer.name = entry.name;
        try {
            const std::unique_ptr<Detector> detector = make_detector(entry.name);
            detector->prepare(topology, frame);
            detector->update(frame, 0.0);
            detector->detect(frame, answer.contacts);
            derive(topology, frame, answer.contacts);
        } catch (const std::exception& error) {
            answer.contacts.outcome = {OutcomeKind::threw, error.what()};
        }
        if (answer.contacts.outcome.ok()) {
            answer.false_negatives = difference(truth, answer.contacts.pairs);
            answer.false_positives = difference(answer.contacts.pairs, truth);
        }
        answers.push_back(std::move(answer));
    }
    return answers;
}

/// "a,b" where a and b are triangle numbers of the bodies' files, each optionally with its body: "tool:12,sheet:40".
struct PairOption {
    std::array<std::string, 2> body;
    std::array<Index, 2> number{-1, -1};

    explicit PairOption(const std::string& text) {
        const auto malformed = [&text] {
            return InputError("--pair", "", "a,b or BODY:a,BODY:b with triangle numbers >= 0",
                              fmt::format("'{}'", text));
        };
        const auto comma = text.find(',');
        if (comma == std::string::npos) throw malformed();
        const std::array<std::string, 2> sides{text.substr(0, comma), text.substr(comma + 1)};
        for (std::size_t i = 0; i < 2; ++i) {
            const auto colon = sides.at(i).rfind(':');
            if (colon != std::string::npos) body.at(i) = sides.at(i).substr(0, colon);
            const std::string digits = colon == std::string::npos ? sides.at(i) : sides.at(i).substr(colon + 1);
            number.at(i) = number_of_text<Index>(digits).value_or(-1);
            if (number.at(i) < 0) throw malformed();
        }
    }
};

/// The pairs that the option can mean: one per body pair that has such triangles.
std::vector<TrianglePair> pairs_meant(const Scene& scene, const Names& names, const PairOption& option) {
    std::vector<TrianglePair> pairs;
    for (const auto& [first, second] : scene.topology.body_pairs) {
        for (const auto& [a, b] : {std::pair{first, second}, std::pair{second, first}}) {
            if (!option.body[0].empty() && option.body[0] != names.body_name(a)) continue;
            if (!option.body[1].empty() && option.body[1] != names.body_name(b)) continue;
            const bool swapped = a != first;
            // Numbers without bodies are read in the order of the scene's bodies.
            if (swapped && option.body[0].empty() && option.body[1].empty()) continue;
            const Index i = names.triangle(a, option.number[0]);
            const Index j = names.triangle(b, option.number[1]);
            if (i >= 0 && j >= 0) pairs.push_back({std::min(i, j), std::max(i, j)});
        }
    }
    if (pairs.empty()) {
        std::vector<std::string> known;
        for (const auto& [a, b] : scene.topology.body_pairs) {
            known.push_back(fmt::format("{} (0 to {}) x {} (0 to {})", names.body_name(a),
                                        scene.topology.bodies[at(a)].triangles.count - 1, names.body_name(b),
                                        scene.topology.bodies[at(b)].triangles.count - 1));
        }
        throw InputError("--pair", "", fmt::format("triangles of {}", fmt::join(known, ", ")),
                         fmt::format("{},{}", option.number[0], option.number[1]));
    }
    return pairs;
}

Json contact_json(const Contact& contact, const Names& names) {
    return {
        {"case", contact.kind == ContactCase::unset ? "not given"
                                                    : contact_case_words.at(static_cast<std::size_t>(contact.kind))},
        {"point", json_vector(contact.point)},
        {"normal", json_vector(contact.normal)},
        {"depth", json_number(contact.depth)},
        {"interval_length", json_number(contact.interval_length)},
        {"interval_direction", json_vector(contact.interval_direction)},
        {"vertex_a", names.vertex_json(contact.vertex_a)},
        {"vertex_b", names.vertex_json(contact.vertex_b)}};
}

void print_contact(const char* label, const Json& contact) {
    fmt::print("    {:<16} {}, depth {}, normal {}, point {} mm", label, contact["case"].get<std::string>(),
               length_text(contact["depth"]), vector_text(contact["normal"], 1.0), vector_text(contact["point"], 1e3));
    if (contact["interval_length"].is_number()) fmt::print(", overlap {}", length_text(contact["interval_length"]));
    if (contact["vertex_a"].is_number()) fmt::print(", vertex of a {}", contact["vertex_a"].get<Index>());
    if (contact["vertex_b"].is_number()) fmt::print(", vertex of b {}", contact["vertex_b"].get<Index>());
    fmt::print("\n");
}

/// Everything that can be said about one triangle pair on one frame.
Json pair_json(const Scene& scene, const Frame& frame, const DepthTruth& depth,
               const std::vector<ExplainedAnswer>& answers, const Names& names, TrianglePair pair) {
    const Corners a = corners_of(scene.topology.triangles, frame.position, pair.a);
    const Corners b = corners_of(scene.topology.triangles, frame.position, pair.b);
    const Crossing crossing = cross_triangles(a, b);
    const auto depths_in = [&](Index triangle, Index body) {
        std::array<double, 3> depths{};
        for (int corner = 0; corner < 3; ++corner) {
            depths.at(static_cast<std::size_t>(corner)) =
                depth.depth_of_vertex(scene.topology.triangles(corner, triangle), body);
        }
        return depths;
    };
    Json ends = Json::array();
    for (const CrossingEnd& end : crossing.ends) {
        if (end.triangle < 0) continue;
        ends.push_back(
            {{"triangle", end.triangle == 0 ? "a" : "b"}, {"edge", end.edge}, {"point", json_vector(end.point)}});
    }
    Json json = names.json(pair);
    json["truth"] = {{"class", name_of(oracle_class(a, b))},
                     {"depth_of_a_corners", depths_in(pair.a, names.body_of(pair.b))},
                     {"depth_of_b_corners", depths_in(pair.b, names.body_of(pair.a))}};
    json["crossing"] = {{"plane_depth_of_a_corners", crossing.first_depth},
                        {"plane_depth_of_b_corners", crossing.second_depth},
                        {"overlap_length", crossing.length},
                        {"direction", json_vector(crossing.direction)},
                        {"interval_a", crossing.first_interval},
                        {"interval_b", crossing.second_interval},
                        {"ends", ends}};
    json["intersection"] = contact_json(derive_contact(scene.topology, frame, pair), names);
    json["detectors"] = Json::array();
    for (const ExplainedAnswer& answer : answers) {
        const std::vector<TrianglePair>& pairs = answer.contacts.pairs;
        Json native = Json::array();
        for (const Contact& contact : answer.contacts.native) {
            if (contact.a == pair.a && contact.b == pair.b) native.push_back(contact_json(contact, names));
        }
        json["detectors"].push_back({{"name", answer.name},
                                     {"reported", std::binary_search(pairs.begin(), pairs.end(), pair)},
                                     {"native", native}});
    }
    return json;
}

std::string pair_text(const Json& pair) {
    return fmt::format("{} {} x {} {}", pair["bodies"][0].get<std::string>(), pair["triangles"][0].get<Index>(),
                       pair["bodies"][1].get<std::string>(), pair["triangles"][1].get<Index>());
}

void print_pair(const Json& pair) {
    const Json& truth = pair["truth"];
    const Json& crossing = pair["crossing"];
    fmt::print("\nPair {}\n", pair_text(pair));
    fmt::print("    {:<16} {}; depth of a's corners {}, of b's corners {}\n", "truth",
               truth["class"].get<std::string>(), three_in_mm(truth["depth_of_a_corners"]),
               three_in_mm(truth["depth_of_b_corners"]));
    fmt::print("    {:<16} a's corners {} below b's plane, b's {} below a's\n", "planes",
               three_in_mm(crossing["plane_depth_of_a_corners"]), three_in_mm(crossing["plane_depth_of_b_corners"]));
    fmt::print("    {:<16} {} along {}\n", "overlap", length_text(crossing["overlap_length"]),
               vector_text(crossing["direction"], 1.0));
    for (const Json& end : crossing["ends"]) {
        fmt::print("    {:<16} edge {} of {} at {} mm\n", "overlap end", end["edge"].get<int>(),
                   end["triangle"].get<std::string>(), vector_text(end["point"], 1e3));
    }
    print_contact("intersection", pair["intersection"]);
    for (const Json& answer : pair["detectors"]) {
        fmt::print("    {:<16} {}\n", answer["name"].get<std::string>(),
                   answer["reported"].get<bool>() ? "reports the pair" : "does not report it");
        for (const Json& contact : answer["native"]) print_contact("  its contact", contact);
    }
}

Json pairs_json(const std::vector<TrianglePair>& pairs, const Names& names) {
    Json list = Json::array();
    for (const TrianglePair pair : pairs) list.push_back(names.json(pair));
    return list;
}

void print_pairs(const char* label, const Json& pairs) {
    constexpr std::size_t most = 5;
    for (std::size_t i = 0; i < std::min(most, pairs.size()); ++i) {
        fmt::print("    {:<9} {}\n", label, pair_text(pairs[i]));
    }
    if (pairs.size() > most) fmt::print("    {:<9} and {} more (all with --json)\n", label, pairs.size() - most);
}

}  // namespace

int explain(const CommonOptions& common, const ExplainOptions& options) {
    std::optional<PairOption> pair_option;
    if (!options.pair.empty()) pair_option.emplace(options.pair);
    // Who drives the scene to the tick: the same default as in `trocar run`.
    const MethodSpec leader = parse_method(MethodChoice{}.detector);
    const MethodSpec response = parse_method(options.response);
    std::unique_ptr<Detector> detector = make_detector(leader.name, leader.parameters);
    std::unique_ptr<Response> responder = make_response(response.name, response.parameters);
    const Scene scene = read_scene(options.scene, common.data);
    if (options.tick < 0 || options.tick >= scene.ticks) {
        throw InputError("--tick", "", fmt::format("a tick from 0 to {}", scene.ticks - 1),
                         fmt::format("{}", options.tick));
    }
    const Names names(scene);
    std::vector<TrianglePair> wanted;
    if (pair_option) wanted = pairs_meant(scene, names, *pair_option);

    Simulation simulation(scene, std::move(detector), std::move(responder),
                          registry().contact_generator("intersection"));
    DepthTruth depth(scene.topology, scene.first);
    for (std::int64_t tick = 0; tick <= options.tick; ++tick) {
        simulation.step();
        depth.measure(simulation.seen());
        // What the response does with the very tick that is examined comes after the frame that is examined.
        if (!simulation.outcome().ok() && tick < options.tick) {
            fmt::print(stderr, "trocar: {} + {} ended as {} at tick {}: {}\n", leader.text(), response.text(),
                       name_of(simulation.outcome().kind), tick, simulation.outcome().message);
            return method_failed;
        }
    }
    const Frame& frame = simulation.seen();
    const auto [truth, touches] = truth_of(scene.topology, frame);
    const std::vector<ExplainedAnswer> answers = ask_all(scene.topology, frame, truth);
    Json examined = Json::array();
    for (const TrianglePair pair : wanted) {
        examined.push_back(pair_json(scene, frame, depth, answers, names, pair));
    }
    Json detectors = Json::array();
    for (const ExplainedAnswer& answer : answers) {
        detectors.push_back({{"name", answer.name},
                             {"outcome", name_of(answer.contacts.outcome.kind)},
                             {"message", answer.contacts.outcome.message},
                             {"pairs", answer.contacts.pairs.size()},
                             {"native_contacts", answer.contacts.native.size()},
                             {"false_negatives", pairs_json(answer.false_negatives, names)},
                             {"false_positives", pairs_json(answer.false_positives, names)}});
    }
    if (common.json) {
        const Json document{{"scene", scene.name},
                            {"tick", frame.tick},
                            {"time", frame.time},
                            {"driven_by", {leader.text(), response.text()}},
                            {"frame_hash", fmt::format("{:016x}", frame.hash())},
                            {"truth", {{"pairs", pairs_json(truth, names)}, {"touches", touches}}},
                            {"detectors", detectors},
                            {"examined", examined}};
        print_json_line(document);
        return done;
    }
    fmt::print("scene {} at tick {} ({:g} s), driven there by {} + {}\n", scene.name, frame.tick, frame.time,
               leader.text(), response.text());
    fmt::print("truth: {} pairs, {} of them only touch\n\n", truth.size(), touches.size());
    constexpr const char* row = "{:<16} {:<12} {:>8} {:>8} {:>8} {:>16}\n";
    fmt::print(fmt::runtime(row), "detector", "outcome", "pairs", "FN", "FP", "native contacts");
    for (const Json& one : detectors) {
        fmt::print(fmt::runtime(row), one["name"].get<std::string>(), one["outcome"].get<std::string>(),
                   one["pairs"].get<std::size_t>(), one["false_negatives"].size(), one["false_positives"].size(),
                   one["native_contacts"].get<std::size_t>());
        if (one["outcome"] != "ok") fmt::print("    {}\n", one["message"].get<std::string>());
        print_pairs("false negatives", one["false_negatives"]);
        print_pairs("false positives", one["false_positives"]);
    }
    if (examined.empty() && !truth.empty()) {
        fmt::print("\nLook at a pair with --pair {}:{},{}:{}\n", names.body_name(names.body_of(truth.front().a)),
                   names.file_triangle(truth.front().a), names.body_name(names.body_of(truth.front().b)),
                   names.file_triangle(truth.front().b));
    }
    for (const Json& pair : examined) print_pair(pair);
    return done;
}

}  // namespace trocar::app
