#include "scene/tissue_materials.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

struct Edge {
    double area = 0.0;  ///< m², sum over its triangles
    int triangles = 0;
    double k = 0.0;
};
using Edges = std::map<std::pair<Index, Index>, Edge>;

std::pair<Index, Index> key_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

/// Per vertex, N/m: a diagonal that is at least the stiffness of springs and enclosures at rest.
std::vector<double> stiffness_majorant(const Materials& materials, const Matrix3X& position, Range vertices) {
    std::vector<double> sum(at(vertices.count), 0.0);
    for (const Spring& spring : materials.springs) {
        for (const Index v : {spring.i, spring.j}) {
            if (vertices.contains(v)) sum[at(v - vertices.first)] += spring.k;
        }
    }
    for (double& stiffness : sum) stiffness *= 2.0;
    // K/V g gᵀ is at most λ M with its one frequency λ = K/V Σ g²/m.
    for (const Enclosure& enclosure : materials.enclosures) {
        if (enclosure.triangles.cols() == 0 || !vertices.contains(enclosure.triangles(0, 0))) continue;
        Matrix3X gradient = Matrix3X::Zero(3, position.cols());
        add_volume_gradient(enclosure.triangles, position, 1.0, gradient);
        double square = 0.0;
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            if (materials.is_free(v)) square += gradient.col(v).squaredNorm() / materials.mass[at(v)];
        }
        const double lambda = enclosure.bulk_modulus / enclosure.volume * square;
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            sum[at(v - vertices.first)] += lambda * materials.mass[at(v)];
        }
    }
    return sum;
}

/// METHODS §4: w² <= 2 Σ k/m and damping rate <= 2 Σ c/m; the root of w² h² + rate h = 4, with 5 % to spare.
int enough_substeps(const Materials& materials, const Matrix3X& position, Range vertices, double dt) {
    const std::vector<double> k = stiffness_majorant(materials, position, vertices);
    std::vector<double> c(at(vertices.count), 0.0);
    for (const Spring& spring : materials.springs) {
        for (const Index v : {spring.i, spring.j}) {
            if (vertices.contains(v)) c[at(v - vertices.first)] += spring.damping;
        }
    }
    constexpr int default_substeps = 4;
    double most = default_substeps;
    for (Index i = 0; i < vertices.count; ++i) {
        const Index v = vertices.first + i;
        const double mass = materials.mass[at(v)];
        if (!materials.is_free(v)) continue;
        const double stiffness = k[at(i)] / mass;
        const double damping = 2.0 * c[at(i)] / mass + materials.drag[at(v)] / mass;
        if (stiffness <= 0.0) continue;
        const double step = (std::sqrt(damping * damping + 16.0 * stiffness) - damping) / (2.0 * stiffness);
        most = std::fmax(most, std::ceil(1.05 * dt / step));
    }
    return most < most_substeps ? static_cast<int>(most) : most_substeps;
}

}  // namespace

void prepare_tissue_arrays(const Topology& topology, Materials& materials) {
    const std::size_t n = at(topology.vertex_count);
    materials.rest_bias = Matrix3X::Zero(3, topology.vertex_count);
    materials.pinned.assign(n, 0);
    materials.mass.assign(n, 0.0);
    materials.area.assign(n, 0.0);
    materials.mean_stiffness.assign(n, 0.0);
    materials.drag.assign(n, 0.0);
    materials.triangle_stiffness.assign(at(topology.triangle_count()), 0.0);
    materials.substeps = 1;
    materials.strain_limit = std::numeric_limits<double>::infinity();
}

void add_tissue_body(const TissueSettings& settings, const Topology& topology, const BodyRange& body,
                     const Matrix3X& position, double dt, Materials& materials) {
    Edges edges;
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        const double area = 0.5 * area_normal(corners_of(topology.triangles, position, t)).norm();
        for (int corner = 0; corner < 3; ++corner) {
            const Index a = topology.triangles(corner, t);
            const Index b = topology.triangles((corner + 1) % 3, t);
            materials.area[at(a)] += area / 3.0;
            if (a == b) continue;
            Edge& edge = edges[key_of(a, b)];
            edge.area += area;
            ++edge.triangles;
        }
    }
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
        materials.mass[at(v)] = settings.density * settings.thickness * materials.area[at(v)];
        materials.drag[at(v)] = settings.drag * materials.mass[at(v)];
    }
    if (settings.rim_pinned) {
        for (const auto& [ends, edge] : edges) {
            if (edge.triangles != 1) continue;
            materials.pinned[at(ends.first)] = 1;
            materials.pinned[at(ends.second)] = 1;
        }
    }
    for (const Index v : settings.pinned) materials.pinned[at(body.vertices.first + v)] = 1;

    std::vector<int> springs_at(at(body.vertices.count), 0);
    for (auto& [ends, edge] : edges) {
        const auto [i, j] = ends;
        const Vector3 along = position.col(j) - position.col(i);
        const double rest = along.norm();
        if (!(rest > 0.0)) continue;
        edge.k = settings.youngs_modulus * settings.thickness * edge.area / (rest * rest);
        const double tension = settings.preload * edge.k * rest;
        materials.springs.push_back(
            {.i = i, .j = j, .rest = rest, .k = edge.k, .preload = tension, .damping = settings.damping});
        const Vector3 pull = tension / rest * along;
        if (materials.pinned[at(i)] == 0) materials.rest_bias.col(i) -= pull;
        if (materials.pinned[at(j)] == 0) materials.rest_bias.col(j) += pull;
        for (const Index v : {i, j}) {
            materials.mean_stiffness[at(v)] += edge.k;
            ++springs_at[at(v - body.vertices.first)];
        }
    }
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
        const int count = springs_at[at(v - body.vertices.first)];
        if (count > 0) materials.mean_stiffness[at(v)] /= count;
    }
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        double sum = 0.0;
        for (int corner = 0; corner < 3; ++corner) {
            const auto found =
                edges.find(key_of(topology.triangles(corner, t), topology.triangles((corner + 1) % 3, t)));
            if (found != edges.end()) sum += found->second.k;
        }
        materials.triangle_stiffness[at(t)] = sum / 3.0;
    }
    if (settings.bulk_modulus > 0.0) {
        Enclosure enclosure{.triangles = topology.triangles.middleCols(body.triangles.first, body.triangles.count),
                            .bulk_modulus = settings.bulk_modulus};
        enclosure.volume = enclosed_volume(enclosure.triangles, position);
        materials.enclosures.push_back(std::move(enclosure));
    }
    const int substeps =
        settings.substeps ? *settings.substeps : enough_substeps(materials, position, body.vertices, dt);
    materials.substeps = std::max(materials.substeps, substeps);
    materials.strain_limit = std::fmin(materials.strain_limit, settings.strain_limit);
}

}  // namespace trocar
