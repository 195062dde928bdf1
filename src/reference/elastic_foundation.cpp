#include "reference/elastic_foundation.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

constexpr double kappa_default = 3e6;  ///< N/m³, METHODS §12
constexpr double k_default = 1000.0;   ///< N/m, between bodies that do not deform
constexpr double mu_default = 2.0;     ///< N s/m
constexpr double open_depth = 0.01;    ///< m, points up to this far beyond an open sheet count

}  // namespace

/// Calls with every sample point that may be inside the other body and the nearest point of that body.
template <typename Use>
void ElasticFoundation::for_each_sample(Foundation& foundation, const Matrix3X& x, Use&& use) {
    const Topology& topology = scene_->topology;
    const SignedDistance& master = masters_[at(foundation.master)];
    const BodyRange& body = topology.bodies[at(foundation.slave)];
    const bool closed = topology.bodies[at(foundation.master)].closed;
    Box extent = master.box();
    if (!closed) {
        extent = extent.grown(open_depth);
    }
    const auto moved_of = [&](Range range) {
        return (x - foundation.searched_from).middleCols(range.first, range.count).colwise().norm().maxCoeff();
    };
    double moved = moved_of(body.vertices) + moved_of(topology.bodies[at(foundation.master)].vertices);
    constexpr double search_again = 3e-4;  // m
    if (moved > search_again) {
        foundation.searched_from = x;
        std::fill(foundation.clearance.begin(), foundation.clearance.end(), 0.0);
        moved = 0.0;
    }
    const std::size_t points = foundation.weights.size();
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        const auto corner = topology.triangles.col(t);
        if (!box_of(corners_of(topology.triangles, x, t)).overlaps(extent)) continue;
        const std::size_t first = at(t - body.triangles.first);
        for (std::size_t p = 0; p < points; ++p) {
            double& clearance = foundation.clearance[first * points + p];
            if (clearance > moved) continue;
            const Vector3& w = foundation.weights[p];
            const Vector3 place = w[0] * x.col(corner[0]) + w[1] * x.col(corner[1]) + w[2] * x.col(corner[2]);
            if (!box_of(place, place).overlaps(extent)) continue;
            SurfacePoint near = master.nearest(topology.triangles, x, place);
            if (near.triangle < 0 || (!closed && near.beyond_rim)) continue;
            near.signed_distance *= foundation.side;
            near.normal *= foundation.side;
            clearance = std::max(0.0, near.signed_distance - moved);
            use(first * points + p, t, w, foundation.area[first] / static_cast<double>(points), near);
        }
    }
}

ElasticFoundation::ElasticFoundation(const Scene& scene, const std::vector<std::array<Index, 2>>& contact_bodies,
                                     int points, const Matrix3X& x)
    : scene_(&scene) {
    const Topology& topology = scene_->topology;
    masters_.resize(topology.bodies.size());
    for (const auto& [a, b] : contact_bodies) {
        const bool tissue_a = topology.bodies[at(a)].kind == BodyKind::tissue;
        const bool tissue_b = topology.bodies[at(b)].kind == BodyKind::tissue;
        const ContactLaw law = scene_->materials.contact_laws[at(topology.body_pair(a, b))];
        const double share = tissue_a && tissue_b ? 0.5 : 1.0;
        if (tissue_b) lay(b, a, law, share, points, x);
        if (tissue_a || !tissue_b) lay(a, b, law, share, points, x);
    }
}

void ElasticFoundation::lay(Index slave, Index master, const ContactLaw& law, double share, int points,
                            const Matrix3X& x) {
    const Topology& topology = scene_->topology;
    const BodyRange& body = topology.bodies[at(slave)];
    Foundation foundation;
    foundation.slave = slave;
    foundation.master = master;
    double total = 0.0;
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        foundation.area.push_back(0.5 * area_normal(corners_of(topology.triangles, scene_->first.position, t)).norm());
        total += foundation.area.back();
    }
    const double mean_area = total / body.vertices.count;
    const bool tissue = body.kind == BodyKind::tissue;
    const double k = std::isnan(law.k) ? (tissue ? kappa_default * mean_area : k_default) : law.k;
    foundation.kappa = share * k / mean_area;
    foundation.eta = share * (std::isnan(law.mu) ? mu_default : law.mu) / mean_area;
    // Centroids of the n² equal triangles into which a triangle is cut.
    const int n = points;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; i + j < n; ++j) {
            const double third = 1.0 / 3.0;
            foundation.weights.emplace_back((i + third) / n, (j + third) / n, 1.0 - (i + j + 2.0 * third) / n);
            if (i + j + 1 < n) {
                foundation.weights.emplace_back((i + 2.0 * third) / n, (j + 2.0 * third) / n,
                                                1.0 - (i + j + 4.0 * third) / n);
            }
        }
    }
    foundation.depth_before.assign(foundation.area.size() * foundation.weights.size(), 0.0);
    foundation.clearance.assign(foundation.depth_before.size(), 0.0);
    foundation.searched_from = x;
    masters_[at(master)].prepare(topology.triangles, topology.bodies[at(master)].triangles, x);
    foundation.most_depth = most_depth_of(master, x);
    foundations_.push_back(std::move(foundation));
    if (topology.bodies[at(master)].closed) return;
    double sum = 0.0;
    for_each_sample(foundations_.back(), x,
                    [&](std::size_t, Index, const Vector3&, double area, const SurfacePoint& near) {
                        sum += area * near.signed_distance;
                    });
    foundations_.back().side = sum < 0.0 ? -1.0 : 1.0;
    std::fill(foundations_.back().clearance.begin(), foundations_.back().clearance.end(), 0.0);
}

/// Three quarters of the largest depth inside a closed body (found by going inwards from every face), or the greatest
/// depth that counts behind an open one.
double ElasticFoundation::most_depth_of(Index master, const Matrix3X& x) const {
    const Topology& topology = scene_->topology;
    if (!topology.bodies[at(master)].closed) return open_depth;
    const SignedDistance& surface = masters_[at(master)];
    const BodyRange& body = topology.bodies[at(master)];
    const double size = (surface.box().max - surface.box().min).maxCoeff();
    double deepest = 0.0;
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        const Corners corners = corners_of(topology.triangles, x, t);
        const Vector3 middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        const Vector3 inwards = -area_normal(corners).normalized();
        constexpr int places = 64;
        for (int i = 1; i <= places; ++i) {
            const Vector3 place = middle + 0.5 * size * i / places * inwards;
            const double depth = -surface.nearest(topology.triangles, x, place).signed_distance;
            if (depth <= 0.0) break;
            deepest = std::max(deepest, depth);
        }
    }
    return 0.75 * deepest;
}

double ElasticFoundation::energy(const Matrix3X& x, double h, std::vector<ContactTerm>* terms, double& smallest_gap) {
    const Topology& topology = scene_->topology;
    double value = 0.0;
    if (terms != nullptr) smallest_gap = std::numeric_limits<double>::infinity();
    for (auto& master : masters_) {
        if (!master.empty()) master.refit(topology.triangles, x);
    }
    for (Foundation& foundation : foundations_) {
        for_each_sample(foundation, x,
                        [&](std::size_t sample, Index t, const Vector3& w, double area, const SurfacePoint& near) {
                            const double depth = -near.signed_distance;
                            const double rate_factor = h > 0.0 ? foundation.eta / h : 0.0;
                            const double stiffness = area * (foundation.kappa + rate_factor);
                            const double free_depth =
                                foundation.depth_before[sample] * rate_factor / (foundation.kappa + rate_factor);
                            if (terms != nullptr) smallest_gap = std::min(smallest_gap, -depth);
                            const double pressed = depth - free_depth;
                            if (pressed <= 0.0) return;
                            value += 0.5 * stiffness * pressed * pressed;
                            if (terms == nullptr) return;
                            ContactTerm term;
                            term.slope = stiffness * pressed;
                            term.curvature = stiffness;
                            term.count = 6;
                            for (std::size_t i = 0; i < 3; ++i) {
                                const auto corner = static_cast<Eigen::Index>(i);
                                term.vertex.at(i) = topology.triangles(corner, t);
                                term.gradient.at(i) = -w[corner] * near.normal;
                                term.vertex.at(3 + i) = topology.triangles(corner, near.triangle);
                                term.gradient.at(3 + i) = near.weights[corner] * near.normal;
                            }
                            terms->push_back(term);
                        });
    }
    return value;
}

bool ElasticFoundation::remember_depths(const Matrix3X& x) {
    bool shallow = true;
    for (Foundation& foundation : foundations_) {
        std::fill(foundation.depth_before.begin(), foundation.depth_before.end(), 0.0);
        for_each_sample(foundation, x,
                        [&](std::size_t sample, Index, const Vector3&, double, const SurfacePoint& near) {
                            foundation.depth_before[sample] = std::max(0.0, -near.signed_distance);
                            shallow = shallow && -near.signed_distance <= foundation.most_depth;
                        });
    }
    return shallow;
}

}  // namespace trocar
