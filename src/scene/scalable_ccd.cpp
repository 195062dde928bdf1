// Reads a scene of Sample-Scalable-CCD-Data: two frames of one mesh, candidate features and their symbolic answers.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>

#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/whole_file.hpp"
#include "scene/external_frames.hpp"
#include "scene/json_node.hpp"
#include "scene/mesh_bodies.hpp"

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

/// A mesh cut into its connected components, each of which is tested against all others.
struct Components {
    MeshBodies bodies;
    Topology topology;
};

Components components_of(const Mesh& mesh) {
    const auto vertices = static_cast<Index>(mesh.vertices.cols());
    Components result;
    result.bodies =
        cut_into_bodies(mesh.triangles, vertices, component_of_triangle(mesh.triangles, vertices), "components");
    std::vector<std::array<Index, 2>> all_pairs;
    Index number = 0;
    for (Body& body : result.bodies.bodies) {
        body.name = fmt::format("component {}", number);
        body.kind = BodyKind::tissue;
        for (Index other = 0; other < number; ++other) all_pairs.push_back({other, number});
        ++number;
    }
    result.topology = make_topology(result.bodies.bodies, all_pairs);
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
    const auto body_of = [&](Index triangle) {
        return components.bodies.body_of_vertex[at(mesh.triangles(0, triangle))];
    };
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
                    std::minmax(components.bodies.triangle_in_world[at(s)], components.bodies.triangle_in_world[at(t)]);
                pairs.insert({a, b});
            }
        }
    }
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
    first.position = components.bodies.in_world_order(before.vertices);
    first.previous = first.position;
    first.velocity.setZero(3, first.position.cols());
    Frame second;
    second.position = components.bodies.in_world_order(after.vertices);
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
