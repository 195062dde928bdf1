#include "respond/penetration.hpp"

#include <algorithm>
#include <cmath>

#include "respond/common.hpp"
#include "respond/equations.hpp"

namespace trocar {

void follow_surface(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                    const Vector3& point, Index& triangle, Vector3& weights) {
    const auto distance_to = [&](Index t, Vector3& w) {
        const equations::Corners corners = corners_of(topology, frame.position, t);
        w = closest_point_on_triangle(corners, point);
        return (equations::point_at(corners, w) - point).norm();
    };
    double distance = distance_to(triangle, weights);
    constexpr int most_steps = 4;
    for (int step = 0; step < most_steps; ++step) {
        const Index centre = triangle;
        for (int i = 0; i < 3; ++i) {
            for (const Index t : surface.triangles_at(topology.triangles(i, centre))) {
                Vector3 w;
                const double here = distance_to(t, w);
                if (here < distance) {
                    distance = here;
                    triangle = t;
                    weights = w;
                }
            }
        }
        if (triangle == centre) break;
    }
}

void SampleLayers::begin(const LedgerSample& sample, Index tissue) {
    sample_ = sample;
    tissue_ = tissue;
    x_ = sample.of(frame_->position);
    layers_.clear();
}

void SampleLayers::keep(const Penetration& layer) {
    layers_.push_back(layer);
    Penetration& kept = layers_.back();
    ++kept.age;
    follow(x_, kept.triangle, kept.weights);
}

int SampleLayers::crossings() const {
    int sum = 0;
    for (const Penetration& layer : layers_) sum += layer.crossed;
    return sum;
}

Vector3 SampleLayers::anchor_of(const Penetration& layer) const {
    return equations::point_at(corners_of(*topology_, frame_->position, layer.triangle), layer.weights);
}

/// True where the layer's nearest point is found by a walk over the surface from the triangle: from the other wall of
/// a fold it is not.
bool SampleLayers::is_of(const Penetration& layer, Index triangle) const {
    if (layer.triangle == triangle) return true;
    const Vector3 foot = anchor_of(layer);
    Vector3 weights;
    follow(foot, triangle, weights);
    const auto corner = topology_->triangles.col(layer.triangle);
    const auto reached = topology_->triangles.col(triangle);
    int shared = 0;
    for (int i = 0; i < 3; ++i) shared += (reached.array() == corner[i]).any() ? 1 : 0;
    if (shared == 3) return true;
    return shared > 0 && area_normal(*topology_, frame_->position, triangle)
                                 .dot(area_normal(*topology_, frame_->position, layer.triangle)) > 0.0;
}

void SampleLayers::cross(Index triangle, int crossings) {
    Vector3 weights;
    follow(x_, triangle, weights);
    const auto known =
        std::find_if(layers_.begin(), layers_.end(), [&](const Penetration& layer) { return is_of(layer, triangle); });
    if (known != layers_.end()) {
        known->crossed += crossings;
        return;
    }
    Penetration layer;
    layer.sample = sample_;
    layer.tissue = tissue_;
    layer.triangle = triangle;
    layer.weights = weights;
    layer.crossed = crossings;
    layers_.push_back(layer);
}

bool SampleLayers::is_behind(const Penetration& layer) const {
    return surface_->is_behind(*topology_, frame_->position, layer.triangle, layer.weights, x_);
}

bool SampleLayers::is_clear(const Penetration& layer) const {
    constexpr double rounding = 1e-9;  // m: as near, the sample is on neither side
    const Vector3 foot = anchor_of(layer);
    if ((foot - x_).norm() < rounding) return false;
    return is_behind(layer) != (layer.crossed > 0);
}

void SampleLayers::cancel() {
    if (layers_.size() < 2) return;
    for (Penetration& a : layers_) {
        if (a.crossed == 0 || !is_clear(a)) continue;
        for (Penetration& b : layers_) {
            if (a.crossed * b.crossed >= 0) continue;
            const int both = std::min(std::abs(a.crossed), std::abs(b.crossed)) * (a.crossed > 0 ? 1 : -1);
            a.crossed -= both;
            b.crossed += both;
        }
    }
}

bool SampleLayers::any_crossed() const {
    return std::any_of(layers_.begin(), layers_.end(), [](const Penetration& layer) { return layer.crossed != 0; });
}

void SampleLayers::forget_crossings() {
    for (Penetration& layer : layers_) layer.crossed = 0;
}

/// From the nearest point to the one that the normal meets: pushing the surface there along the normal closes the depth
/// and nothing else.
void SampleLayers::place(Penetration& layer) const {
    layer.normal = layer.side * surface_->blended_normal(*topology_, frame_->position, layer.triangle, layer.weights);
    equations::Corners corners = corners_of(*topology_, frame_->position, layer.triangle);
    const Vector3 face = equations::unit_normal(corners);
    const double slope = face.dot(layer.normal);
    constexpr double least_slope = 0.3;
    if (std::abs(slope) > least_slope) {
        const Vector3 target = x_ + face.dot(corners[0] - x_) / slope * layer.normal;
        follow(target, layer.triangle, layer.weights);
        corners = corners_of(*topology_, frame_->position, layer.triangle);
    }
    layer.face = layer.side * equations::unit_normal(corners);
    layer.depth = layer.normal.dot(anchor_of(layer) - x_);
}

void SampleLayers::turn_outwards(const Vector3& outwards, double shallow) {
    constexpr double against = 0.5;  // cosine
    for (Penetration& layer : layers_) {
        Penetration placed = layer;
        if (layer.crossed != 0) placed.side = layer.crossed > 0 ? 1.0 : -1.0;
        place(placed);
        if (placed.normal.dot(outwards) <= against || std::abs(placed.depth) > shallow) continue;
        layer.side = -placed.side;
        layer.crossed = placed.depth < 0.0 ? static_cast<int>(layer.side) : 0;
    }
}

void SampleLayers::append_to(std::vector<Penetration>& penetrations, double margin) {
    for (Penetration& layer : layers_) {
        if (layer.crossed == 0 && layer.ruptured) continue;
        if (layer.crossed != 0) layer.side = layer.crossed > 0 ? 1.0 : -1.0;
        // Not crossed before, nor after all that it met in this tick: it is where it belongs.
        if (layer.side == 0.0) layer.side = is_behind(layer) ? -1.0 : 1.0;
        place(layer);
        if (layer.crossed == 0 && (anchor_of(layer) - x_).norm() > margin) continue;
        penetrations.push_back(layer);
    }
}

}  // namespace trocar
