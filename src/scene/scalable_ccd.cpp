// Reads a scene of Sample-Scalable-CCD-Data: two frames of one mesh, candidate features and their symbolic answers.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <string>

#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "scene/external_frames.hpp"
#include "scene/json_node.hpp"

namespace trocar {
namespace {

/// The files of a folder whose names end so, in alphabetical order.
std::vector<std::filesystem::path> files_ending(const std::filesystem::path& folder, const std::string& end,
                                                std::size_t count) {
    std::vector<std::filesystem::path> files;
    if (std::filesystem::is_directory(folder)) {
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (entry.path().filename().string().ends_with(end)) files.push_back(entry.path());
        }
    }
    if (files.size() != count) {
        throw InputError(folder.string(), "", fmt::format("{} files *{}", count, end), fmt::format("{}", files.size()));
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// A mesh cut into its connected components. Each becomes a body, in the order of its first triangle.
struct Components {
    std::vector<Index> body_of_vertex;   ///< -1: in no triangle
    std::vector<Index> vertex_in_world;  ///< number in the topology; -1: in no triangle
    std::vector<Index> triangle_in_world;
    Topology topology;
};

Index root_of(std::vector<Index>& parent, Index vertex) {
    while (parent[at(vertex)] != vertex) {
        parent[at(vertex)] = parent[at(parent[at(vertex)])];
        vertex = parent[at(vertex)];
    }
    return vertex;
}

Components components_of(const Mesh& mesh) {
    const auto vertices = static_cast<Index>(mesh.vertices.cols());
    const auto triangles = static_cast<Index>(mesh.triangles.cols());
    std::vector<Index> parent(at(vertices));
    std::iota(parent.begin(), parent.end(), Index{0});
    for (Index t = 0; t < triangles; ++t) {
        for (int k = 1; k < 3; ++k) {
            parent[at(root_of(parent, mesh.triangles(k, t)))] = root_of(parent, mesh.triangles(0, t));
        }
    }
    Components result;
    result.body_of_vertex.assign(at(vertices), -1);
    result.vertex_in_world.assign(at(vertices), -1);
    result.triangle_in_world.assign(at(triangles), -1);
    std::vector<Index> body_of_root(at(vertices), -1);
    std::vector<std::vector<Index>> members;  // triangles by body
    for (Index t = 0; t < triangles; ++t) {
        Index& body = body_of_root[at(root_of(parent, mesh.triangles(0, t)))];
        if (body < 0) {
            body = static_cast<Index>(members.size());
            members.emplace_back();
        }
        members[at(body)].push_back(t);
    }
    if (are_sizes_limited() && members.size() > static_cast<std::size_t>(most_bodies)) {
        throw InputError("components", "", limit_text(most_bodies, "bodies"), fmt::format("{}", members.size()));
    }
    std::vector<std::vector<Index>> vertices_of(members.size());
    for (Index v = 0; v < vertices; ++v) {
        const Index body = body_of_root[at(root_of(parent, v))];
        result.body_of_vertex[at(v)] = body;
        if (body >= 0) vertices_of[at(body)].push_back(v);
    }
    std::vector<Body> bodies;
    bodies.reserve(members.size());
    std::vector<std::array<Index, 2>> all_pairs;
    std::vector<Index> local(at(vertices), -1);
    Index next_vertex = 0;
    Index next_triangle = 0;
    for (std::size_t b = 0; b < members.size(); ++b) {
        Body body{.name = fmt::format("component {}", b), .kind = BodyKind::tissue, .closed = false};
        body.vertex_count = static_cast<Index>(vertices_of[b].size());
        for (Index i = 0; i < body.vertex_count; ++i) {
            const Index v = vertices_of[b][at(i)];
            local[at(v)] = i;
            result.vertex_in_world[at(v)] = next_vertex++;
        }
        body.triangles.resize(3, static_cast<Eigen::Index>(members[b].size()));
        for (std::size_t i = 0; i < members[b].size(); ++i) {
            const Index t = members[b][i];
            result.triangle_in_world[at(t)] = next_triangle++;
            for (int k = 0; k < 3; ++k) {
                body.triangles(k, static_cast<Eigen::Index>(i)) = local[at(mesh.triangles(k, t))];
            }
        }
        for (std::size_t other = 0; other < b; ++other) {
            all_pairs.push_back({static_cast<Index>(other), static_cast<Index>(b)});
        }
        bodies.push_back(std::move(body));
    }
    result.topology = make_topology(bodies, all_pairs);
    return result;
}

/// Numbers of the data set: vertices first, then edges, then triangles in the order of the file.
class Features {
public:
    explicit Features(const Mesh& mesh)
        : mesh_(mesh), vertices_(static_cast<Index>(mesh.vertices.cols())), triangles_of_vertex_(at(vertices_)) {
        for (Index t = 0; t < static_cast<Index>(mesh.triangles.cols()); ++t) {
            for (int k = 0; k < 3; ++k) {
                const Index i = mesh.triangles(k, t);
                const Index j = mesh.triangles((k + 1) % 3, t);
                triangles_of_vertex_[at(i)].push_back(t);
                edges_.push_back({std::max(i, j), std::min(i, j)});
            }
        }
        // Unique edges by their larger vertex, then by the smaller one.
        std::sort(edges_.begin(), edges_.end());
        edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    }

    /// Triangles that hold the feature.
    [[nodiscard]] std::vector<Index> triangles_of(std::int64_t feature) const {
        if (feature < vertices_) return triangles_of_vertex_[at(static_cast<Index>(feature))];
        const std::int64_t edge = feature - vertices_;
        const auto edges = static_cast<std::int64_t>(edges_.size());
        if (edge >= edges) return {static_cast<Index>(edge - edges)};
        const auto& [larger, smaller] = edges_[static_cast<std::size_t>(edge)];
        std::vector<Index> both;
        for (const Index t : triangles_of_vertex_[at(larger)]) {
            if ((mesh_.triangles.col(t).array() == smaller).any()) both.push_back(t);
        }
        return both;
    }
    [[nodiscard]] std::int64_t count() const {
        return vertices_ + static_cast<std::int64_t>(edges_.size()) + mesh_.triangles.cols();
    }

private:
    const Mesh& mesh_;
    Index vertices_;
    std::vector<std::vector<Index>> triangles_of_vertex_;
    std::vector<std::array<Index, 2>> edges_;  ///< larger vertex first
};

/// Adds the pairs of triangles of different bodies that hold the features of a true candidate.
void add_true_candidates(const std::filesystem::path& boxes, const std::filesystem::path& answers, const Mesh& mesh,
                         const Features& features, const Components& components,
                         std::set<std::array<Index, 2>>& pairs) {
    const std::string boxes_name = boxes.string();
    const std::string answers_name = answers.string();
    const Json boxes_document = parse_json(read_whole(boxes, "candidates"), boxes_name);
    const Json answers_document = parse_json(read_whole(answers, "answers"), answers_name);
    const std::vector<JsonNode> candidates = JsonNode(boxes_document, boxes_name).list();
    const std::vector<JsonNode> verdicts = JsonNode(answers_document, answers_name).list();
    if (candidates.size() != verdicts.size()) {
        throw InputError(answers_name, "", fmt::format("{} answers, as there are candidates", candidates.size()),
                         fmt::format("{}", verdicts.size()));
    }
    const auto body_of = [&](Index triangle) { return components.body_of_vertex[at(mesh.triangles(0, triangle))]; };
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        const std::vector<JsonNode> two = candidates[i].list();
        if (two.size() != 2) candidates[i].fail("two feature numbers");
        if (!verdicts[i].flag()) continue;
        const std::vector<Index> first = features.triangles_of(two[0].integer(0, features.count() - 1));
        const std::vector<Index> second = features.triangles_of(two[1].integer(0, features.count() - 1));
        for (const Index s : first) {
            for (const Index t : second) {
                if (body_of(s) == body_of(t)) continue;
                const auto [a, b] =
                    std::minmax(components.triangle_in_world[at(s)], components.triangle_in_world[at(t)]);
                pairs.insert({a, b});
            }
        }
    }
}

Matrix3X in_world_order(const Matrix3X& vertices, const Components& components) {
    Matrix3X ordered(3, components.topology.vertex_count);
    for (std::size_t v = 0; v < components.vertex_in_world.size(); ++v) {
        const Index place = components.vertex_in_world[v];
        if (place >= 0) ordered.col(place) = vertices.col(static_cast<Eigen::Index>(v));
    }
    return ordered;
}

}  // namespace

ExternalFrames read_scalable_ccd(const std::filesystem::path& folder) {
    const std::vector<std::filesystem::path> files = files_ending(folder / "frames", ".ply", 2);
    const Mesh before = read_mesh(files[0]);
    const Mesh after = read_mesh(files[1]);
    if (before.vertices.cols() != after.vertices.cols() || before.triangles != after.triangles) {
        throw InputError(files[1].string(), "", "the triangles of the frame before", "others");
    }
    const Features features(before);
    Components components = components_of(before);
    std::set<std::array<Index, 2>> pairs;
    for (const std::string kind : {"vf", "ee"}) {
        add_true_candidates(files_ending(folder / "boxes", kind + ".json", 1).front(),
                            files_ending(folder / "mma_bool", kind + "_mma_bool.json", 1).front(), before, features,
                            components, pairs);
    }
    ExternalFrames result;
    Frame first;
    first.position = in_world_order(before.vertices, components);
    first.previous = first.position;
    first.velocity.setZero(3, first.position.cols());
    Frame second;
    second.position = in_world_order(after.vertices, components);
    second.previous = first.position;
    second.velocity = second.position - second.previous;
    second.tick = 1;
    second.time = 1.0;
    result.frames = {std::move(first), std::move(second)};
    result.meeting.emplace(pairs.begin(), pairs.end());
    result.topology = std::move(components.topology);
    return result;
}

}  // namespace trocar
