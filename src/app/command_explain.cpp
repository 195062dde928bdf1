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

std::string vector_text(const Vector3& v, double scale) {
    if (!v.allFinite()) return "not given";
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x() * scale, v.y() * scale, v.z() * scale);
}

std::string length_text(double metres) {
    return std::isfinite(metres) ? fmt::format("{:.6g} mm", metres * 1e3) : std::string("not given");
}

/// In the order of ContactCase.
constexpr std::array case_names{"not given", "a_enters_b", "b_enters_a", "edges_cross", "touch",
                                "coplanar",  "degenerate", "point_face", "edge_edge"};

const char* case_name(const Contact& contact) { return case_names.at(static_cast<std::size_t>(contact.kind)); }

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
    [[nodiscard]] std::string text(TrianglePair pair) const {
        return fmt::format("{} {} x {} {}", body_name(body_of(pair.a)), file_triangle(pair.a),
                           body_name(body_of(pair.b)), file_triangle(pair.b));
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
    return {{"case", case_name(contact)},
            {"point", json_vector(contact.point)},
            {"normal", json_vector(contact.normal)},
            {"depth", json_number(contact.depth)},
            {"interval_length", json_number(contact.interval_length)},
            {"interval_direction", json_vector(contact.interval_direction)},
            {"vertex_a", names.vertex_json(contact.vertex_a)},
            {"vertex_b", names.vertex_json(contact.vertex_b)}};
}

void print_contact(const char* label, const Contact& contact, const Names& names) {
    fmt::print("    {:<16} {}, depth {}, normal {}, point {} mm", label, case_name(contact), length_text(contact.depth),
               vector_text(contact.normal, 1.0), vector_text(contact.point, 1e3));
    if (std::isfinite(contact.interval_length)) fmt::print(", overlap {}", length_text(contact.interval_length));
    if (contact.vertex_a >= 0) fmt::print(", vertex of a {}", names.file_vertex(contact.vertex_a));
    if (contact.vertex_b >= 0) fmt::print(", vertex of b {}", names.file_vertex(contact.vertex_b));
    fmt::print("\n");
}

/// Everything that can be said about one triangle pair on one frame.
struct PairFacts {
    TrianglePair pair;
    PairClass true_class = PairClass::disjoint;
    Crossing crossing;
    Contact intersection;
    std::array<double, 3> true_depth_a{};  ///< m, of a's corners against b's body
    std::array<double, 3> true_depth_b{};  ///< m, of b's corners against a's body

    PairFacts(const Scene& scene, const Frame& frame, const DepthTruth& depth, const Names& names,
              TrianglePair the_pair)
        : pair(the_pair) {
        const Corners a = corners_of(scene.topology.triangles, frame.position, pair.a);
        const Corners b = corners_of(scene.topology.triangles, frame.position, pair.b);
        true_class = oracle_class(a, b);
        crossing = cross_triangles(a, b);
        intersection = derive_contact(scene.topology, frame, pair);
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const auto row = static_cast<Eigen::Index>(corner);
            true_depth_a.at(corner) =
                depth.depth_of_vertex(scene.topology.triangles(row, pair.a), names.body_of(pair.b));
            true_depth_b.at(corner) =
                depth.depth_of_vertex(scene.topology.triangles(row, pair.b), names.body_of(pair.a));
        }
    }
};

std::vector<const Contact*> native_of(const ExplainedAnswer& answer, TrianglePair pair) {
    std::vector<const Contact*> found;
    for (const Contact& contact : answer.contacts.native) {
        if (contact.a == pair.a && contact.b == pair.b) found.push_back(&contact);
    }
    return found;
}

bool reports(const ExplainedAnswer& answer, TrianglePair pair) {
    return std::binary_search(answer.contacts.pairs.begin(), answer.contacts.pairs.end(), pair);
}

Json pair_json(const PairFacts& facts, const std::vector<ExplainedAnswer>& answers, const Names& names) {
    Json json = names.json(facts.pair);
    Json ends = Json::array();
    for (const CrossingEnd& end : facts.crossing.ends) {
        if (end.triangle < 0) continue;
        ends.push_back(
            {{"triangle", end.triangle == 0 ? "a" : "b"}, {"edge", end.edge}, {"point", json_vector(end.point)}});
    }
    json["truth"] = {{"class", name_of(facts.true_class)},
                     {"depth_of_a_corners", facts.true_depth_a},
                     {"depth_of_b_corners", facts.true_depth_b}};
    json["crossing"] = {{"plane_depth_of_a_corners", facts.crossing.first_depth},
                        {"plane_depth_of_b_corners", facts.crossing.second_depth},
                        {"overlap_length", facts.crossing.length},
                        {"direction", json_vector(facts.crossing.direction)},
                        {"interval_a", facts.crossing.first_interval},
                        {"interval_b", facts.crossing.second_interval},
                        {"ends", ends}};
    json["intersection"] = contact_json(facts.intersection, names);
    json["detectors"] = Json::array();
    for (const ExplainedAnswer& answer : answers) {
        Json native = Json::array();
        for (const Contact* contact : native_of(answer, facts.pair)) native.push_back(contact_json(*contact, names));
        json["detectors"].push_back(
            {{"name", answer.name}, {"reported", reports(answer, facts.pair)}, {"native", native}});
    }
    return json;
}

void print_pair(const PairFacts& facts, const std::vector<ExplainedAnswer>& answers, const Names& names) {
    const Crossing& crossing = facts.crossing;
    fmt::print("\nPair {}\n", names.text(facts.pair));
    fmt::print(
        "    {:<16} {}; depth of a's corners {:.6g}, {:.6g}, {:.6g} mm, of b's corners {:.6g}, {:.6g}, {:.6g} mm\n",
        "truth", name_of(facts.true_class), facts.true_depth_a[0] * 1e3, facts.true_depth_a[1] * 1e3,
        facts.true_depth_a[2] * 1e3, facts.true_depth_b[0] * 1e3, facts.true_depth_b[1] * 1e3,
        facts.true_depth_b[2] * 1e3);
    fmt::print(
        "    {:<16} a's corners {:.6g}, {:.6g}, {:.6g} mm below b's plane, b's {:.6g}, {:.6g}, {:.6g} mm below a's\n",
        "planes", crossing.first_depth[0] * 1e3, crossing.first_depth[1] * 1e3, crossing.first_depth[2] * 1e3,
        crossing.second_depth[0] * 1e3, crossing.second_depth[1] * 1e3, crossing.second_depth[2] * 1e3);
    fmt::print("    {:<16} {} along {}\n", "overlap", length_text(crossing.length),
               vector_text(crossing.direction, 1.0));
    for (const CrossingEnd& end : crossing.ends) {
        if (end.triangle < 0) continue;
        fmt::print("    {:<16} edge {} of {} at {} mm\n", "overlap end", end.edge, end.triangle == 0 ? "a" : "b",
                   vector_text(end.point, 1e3));
    }
    print_contact("intersection", facts.intersection, names);
    for (const ExplainedAnswer& answer : answers) {
        fmt::print("    {:<16} {}\n", answer.name,
                   reports(answer, facts.pair) ? "reports the pair" : "does not report it");
        for (const Contact* contact : native_of(answer, facts.pair)) print_contact("  its contact", *contact, names);
    }
}

Json pairs_json(const std::vector<TrianglePair>& pairs, const Names& names) {
    Json list = Json::array();
    for (const TrianglePair pair : pairs) list.push_back(names.json(pair));
    return list;
}

void print_pairs(const char* label, const std::vector<TrianglePair>& pairs, const Names& names) {
    constexpr std::size_t most = 5;
    for (std::size_t i = 0; i < std::min(most, pairs.size()); ++i) {
        fmt::print("    {:<9} {}\n", label, names.text(pairs[i]));
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
    std::vector<TrianglePair> truth;
    true_pairs(scene.topology, frame, truth);
    const std::vector<Index> touches = touching_pairs(scene.topology, frame, truth);
    const std::vector<ExplainedAnswer> answers = ask_all(scene.topology, frame, truth);
    std::vector<PairFacts> facts;
    facts.reserve(wanted.size());
    for (const TrianglePair pair : wanted) facts.emplace_back(scene, frame, depth, names, pair);

    if (common.json) {
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
        Json examined = Json::array();
        for (const PairFacts& one : facts) examined.push_back(pair_json(one, answers, names));
        const Json document{{"scene", scene.name},
                            {"tick", frame.tick},
                            {"time", frame.time},
                            {"driven_by", {leader.text(), response.text()}},
                            {"frame_hash", fmt::format("{:016x}", frame.hash())},
                            {"truth", {{"pairs", pairs_json(truth, names)}, {"touches", touches}}},
                            {"detectors", detectors},
                            {"examined", examined}};
        fmt::print("{}\n", document.dump(-1, ' ', false, Json::error_handler_t::replace));
        return done;
    }
    fmt::print("scene {} at tick {} ({:g} s), driven there by {} + {}\n", scene.name, frame.tick, frame.time,
               leader.text(), response.text());
    fmt::print("truth: {} pairs, {} of them only touch\n\n", truth.size(), touches.size());
    fmt::print("{:<16} {:<12} {:>8} {:>8} {:>8} {:>16}\n", "detector", "outcome", "pairs", "FN", "FP",
               "native contacts");
    for (const ExplainedAnswer& answer : answers) {
        fmt::print("{:<16} {:<12} {:>8} {:>8} {:>8} {:>16}\n", answer.name, name_of(answer.contacts.outcome.kind),
                   answer.contacts.pairs.size(), answer.false_negatives.size(), answer.false_positives.size(),
                   answer.contacts.native.size());
        if (!answer.contacts.outcome.ok()) fmt::print("    {}\n", answer.contacts.outcome.message);
        print_pairs("false negatives", answer.false_negatives, names);
        print_pairs("false positives", answer.false_positives, names);
    }
    if (facts.empty() && !truth.empty()) {
        fmt::print("\nLook at a pair with --pair {}:{},{}:{}\n", names.body_name(names.body_of(truth.front().a)),
                   names.file_triangle(truth.front().a), names.body_name(names.body_of(truth.front().b)),
                   names.file_triangle(truth.front().b));
    }
    for (const PairFacts& one : facts) print_pair(one, answers, names);
    return done;
}

}  // namespace trocar::app
