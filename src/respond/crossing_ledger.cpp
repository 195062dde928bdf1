#include "respond/crossing_ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "geometry/signed_crossing.hpp"
#include "respond/common.hpp"
#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// How far around a sample's way a triangle may be at the end of the tick that it met in the tick.
Vector3 margin_of(double largest_move) { return Vector3::Constant(largest_move * 1.0000001 + 1e-9); }

/// Null where none of the tissues is this body.
template <typename Tissues>
auto* with_body(Tissues& tissues, Index body) {
    const auto found =
        std::find_if(tissues.begin(), tissues.end(), [body](const auto& tissue) { return tissue.body == body; });
    return found == tissues.end() ? nullptr : &*found;
}

bool is_solid(const BodyRange& body) { return body.closed && body.kind != BodyKind::tissue; }

}  // namespace

void CrossingLedger::prepare(const Topology& topology, const std::vector<TissueScale>& scales, bool on_edges) {
    started_ = false;
    on_edges_ = on_edges;
    edges_.clear();
    updates_ = 0;
    moved_.clear();
    repairs_ = 0;
    penetrations_.clear();
    tissues_.clear();
    samples_.clear();
    sample_of_vertex_.assign(at(topology.vertex_count), -1);
    const Index bodies = topology.body_count();
    tested_.assign(at(bodies * bodies), 0);
    for (const auto& [a, b] : topology.body_pairs) {
        tested_[at(a * bodies + b)] = 1;
        tested_[at(b * bodies + a)] = 1;
    }
    for (Index body = 0; body < bodies; ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        if (range.kind == BodyKind::tissue) {
            Tissue tissue;
            tissue.body = body;
            tissue.closed = range.closed;
            tissue.edge = scales[at(body)].edge;
            tissue.margin = scales[at(body)].margin;
            tissue.clear = scales[at(body)].clear_depth();
            tissue.blocks.prepare(topology, range.triangles);
            tissues_.push_back(std::move(tissue));
        }
        const bool meets_tissue =
            std::any_of(topology.bodies.begin(), topology.bodies.end(), [&](const BodyRange& other) {
                const auto number = static_cast<Index>(&other - topology.bodies.data());
                return other.kind == BodyKind::tissue && tested_[at(body * bodies + number)] != 0;
            });
        if (meets_tissue) {
            for (Index v = range.vertices.first; v < range.vertices.end(); ++v) {
                sample_of_vertex_[at(v)] = static_cast<Index>(samples_.size());
                samples_.push_back({.vertex = v, .body = body, .key = v});
            }
        }
    }
    for (Tissue& tissue : tissues_) {
        tissue.count.assign(samples_.size(), 0);
        tissue.layers.assign(samples_.size(), {});
    }
}

const CrossingLedger::Tissue* CrossingLedger::tissue_of(Index body) const { return with_body(tissues_, body); }

CrossingLedger::Tissue* CrossingLedger::tissue_of(Index body) { return with_body(tissues_, body); }

int CrossingLedger::count(Index vertex, Index tissue) const {
    const Index sample = sample_of_vertex_[at(vertex)];
    const Tissue* one = tissue_of(tissue);
    return one == nullptr || sample < 0 ? 0 : one->count[at(sample)];
}

bool CrossingLedger::is_free(Index sample, Index tissue) const {
    const Tissue* one = tissue_of(tissue);
    return one == nullptr || (one->count[at(sample)] == 0 && one->layers[at(sample)].count == 0);
}

std::span<const Penetration> CrossingLedger::layers(Index vertex, Index tissue) const {
    const Index sample = sample_of_vertex_[at(vertex)];
    const Tissue* one = tissue_of(tissue);
    if (one == nullptr || sample < 0) return {};
    const Range& range = one->layers[at(sample)];
    return std::span(penetrations_).subspan(at(range.first), at(range.count));
}

/// Null where the edge has no samples of its own.
const CrossingLedger::SampledEdge* CrossingLedger::sampled_edge(Index u, Index v) const {
    const auto key = std::minmax({u, v});
    const auto edge = std::lower_bound(edges_.begin(), edges_.end(), key, [](const SampledEdge& one, const auto& ends) {
        return std::pair{one.u, one.v} < ends;
    });
    return edge != edges_.end() && edge->u == key.first && edge->v == key.second ? &*edge : nullptr;
}

std::span<const Penetration> CrossingLedger::layers_on_edge(Index u, Index v, Index tissue) const {
    const SampledEdge* edge = sampled_edge(u, v);
    const Tissue* one = tissue_of(tissue);
    if (one == nullptr || edge == nullptr) return {};
    const Index first = one->layers[at(edge->samples.first)].first;
    const Index end = one->layers[at(edge->samples.end() - 1)].end();
    return std::span(penetrations_).subspan(at(first), at(end - first));
}

Index CrossingLedger::nearest_triangle(const Topology& topology, const Frame& frame, Tissue& tissue,
                                       const Vector3& point) {
    Index best = -1;
    double best_distance = std::numeric_limits<double>::infinity();
    double reach = tissue.grid.cell();
    const Box& bounds = tissue.grid.bounds();
    const double furthest = (bounds.max - bounds.min).norm() + (point - bounds.min).norm();
    while (true) {
        Box box;
        box.add(point - Vector3::Constant(reach));
        box.add(point + Vector3::Constant(reach));
        const auto holds = [&](const Box& region) {
            return (region.min.array() <= box.min.array()).all() && (region.max.array() >= box.max.array()).all();
        };
        if (!tissue.whole && std::none_of(tissue.regions.begin(), tissue.regions.end(), holds)) {
            fill_whole(topology, frame, tissue);
            return nearest_triangle(topology, frame, tissue, point);
        }
        tissue.grid.visit(box, [&](Index t) {
            const equations::Corners corners = corners_of(topology, frame.position, t);
            const Vector3 w = closest_point_on_triangle(corners, point);
            const double distance = (equations::point_at(corners, w) - point).norm();
            if (distance < best_distance || (distance == best_distance && t < best)) {
                best_distance = distance;
                best = t;
            }
        });
        if (best_distance <= reach || reach > furthest) return best;
        reach *= 2.0;
    }
}

/// Signed crossings of a segment with the surface as it stands.
int CrossingLedger::crossings(const Topology& topology, const Frame& frame, Tissue& tissue, const Vector3& from,
                              const Vector3& to) {
    Box box;
    box.add(from);
    box.add(to);
    int sum = 0;
    tissue.grid.visit(box, [&](Index t) {
        const equations::Corners corners = corners_of(topology, frame.position, t);
        sum += segment_crossing(from, to, corners[0], corners[1], corners[2]);
    });
    return sum;
}

/// A few samples a tick, so that no tick is long: the signed crossings of a ray, and where they differ from the count
/// the winding number, which decides.
void CrossingLedger::check_closed(const Topology& topology, const Frame& frame, Tissue& tissue) {
    const Index bodies = topology.body_count();
    const Box& bounds = tissue.grid.bounds();
    for (auto s = static_cast<std::size_t>(updates_ % check_period); s < samples_.size();
         s += static_cast<std::size_t>(check_period)) {
        if (tested_[at(samples_[s].body * bodies + tissue.body)] == 0) continue;
        const Vector3 x = samples_[s].of(frame.position) + hair;
        const Vector3 end(x.x(), x.y(), std::max(x.z(), bounds.max.z()) + 1.0);
        Box path;
        path.add(x);
        path.add(end);
        int ray = 0;
        tissue.grid.visit(path, [&](Index t) {
            const equations::Corners corners = corners_of(topology, frame.position, t);
            // Outwards through a face is from its back to its front.
            ray -= segment_crossing(x, end, corners[0], corners[1], corners[2]);
        });
        if (ray == tissue.count[s]) continue;
        const double winding =
            winding_number(frame.position, topology.triangles, topology.bodies[at(tissue.body)].triangles, x);
        const auto exact = static_cast<std::int16_t>(std::lround(winding));
        if (exact == tissue.count[s]) continue;
        tissue.count[s] = exact;
        ++repairs_;
    }
}

void CrossingLedger::count_crossings(const Topology& topology, const Frame& frame, Tissue& tissue) {
    tissue.crossings.clear();
    const Index bodies = topology.body_count();
    const auto tested = [&](std::size_t s) { return tested_[at(samples_[s].body * bodies + tissue.body)] != 0; };
    const std::size_t vertices = edges_.empty() ? samples_.size() : at(edges_.front().samples.first);
    for (std::size_t s = 0; s < vertices; ++s) {
        if (tested(s)) count_crossings_of(s, topology, frame, tissue);
    }
    constexpr double rounding = 1e-12;  // m, of a point between the ends of its edge
    const Vector3 margin = margin_of(tissue.largest_move) + Vector3::Constant(rounding);
    for (const SampledEdge& edge : edges_) {
        if (!tested(at(edge.samples.first))) continue;
        Box box;
        for (const Matrix3X* positions : {static_cast<const Matrix3X*>(&last_), &frame.position}) {
            for (const Index end : {edge.u, edge.v}) box.add(positions->col(end) + hair);
        }
        box.min -= margin;
        box.max += margin;
        if (!box.overlaps(tissue.grid.bounds())) continue;
        for (Index s = edge.samples.first; s < edge.samples.end(); ++s) {
            count_crossings_of(at(s), topology, frame, tissue);
        }
    }
}

void CrossingLedger::count_crossings_of(std::size_t s, const Topology& topology, const Frame& frame, Tissue& tissue) {
    const Vector3 from = samples_[s].of(last_) + hair;
    const Vector3 to = samples_[s].of(frame.position) + hair;
    Box path;
    path.add(from);
    path.add(to);
    Box box = path;
    const Vector3 margin = margin_of(tissue.largest_move);
    box.min -= margin;
    box.max += margin;
    int change = 0;
    tissue.grid.visit(box, [&](Index t) {
        std::array<Index, 3> number{};
        for (int i = 0; i < 3; ++i) number[at(i)] = topology.triangles(i, t);
        const equations::Corners before = corners_of(topology, last_, t);
        const equations::Corners after = corners_of(topology, frame.position, t);
        Box here;
        for (const Vector3& corner : after) here.add(corner);
        int sign = 0;
        if (here.overlaps(path)) sign += segment_crossing(from, to, after[0], after[1], after[2]);
        if (before != after) {
            for (const Vector3& corner : before) here.add(corner);
            Box point;
            point.add(from);
            if (here.overlaps(point)) sign += sweep_crossing(from, number, before, after);
        }
        if (sign == 0) return;
        change += sign;
        tissue.crossings.push_back({static_cast<Index>(s), t, sign});
    });
    if (change != 0) tissue.count[s] = static_cast<std::int16_t>(tissue.count[s] + change);
}

/// Per body the box of all that its samples ask of the tissue's grid in this tick, with a few cells to spare for the
/// search of the nearest triangle.
void CrossingLedger::find_regions(const Topology& topology, const Frame& frame, Tissue& tissue) {
    constexpr double spare_cells = 2.0;
    const Vector3 margin = margin_of(tissue.largest_move) + Vector3::Constant(spare_cells * tissue.grid.cell());
    const Index bodies = topology.body_count();
    tissue.regions.clear();
    Index last_body = -1;
    for (const LedgerSample& sample : samples_) {
        if (sample.other >= 0) break;  // points of edges lie between the vertices, which come before them
        if (tested_[at(sample.body * bodies + tissue.body)] == 0) continue;
        if (sample.body != last_body) tissue.regions.emplace_back();
        last_body = sample.body;
        Box& region = tissue.regions.back();
        for (const Matrix3X* positions : {static_cast<const Matrix3X*>(&last_), &frame.position}) {
            const Vector3 at_sample = sample.of(*positions);
            if (!at_sample.allFinite()) continue;
            region.add(at_sample - margin);
            region.add(at_sample + margin);
        }
    }
    // The check of closed tissue looks upwards from a sample without end.
    if (!tissue.closed) return;
    for (Box& region : tissue.regions) region.max.z() = std::numeric_limits<double>::infinity();
}

/// Only what lies near the samples: a grid over all tissue would cost more than the rest of the response.
void CrossingLedger::fill_near(const Topology& topology, const Frame& frame, Tissue& tissue) {
    const Range vertices = topology.bodies[at(tissue.body)].vertices;
    double largest_square = 0.0;
    double not_finite = 0.0;  // a finite number times zero is zero; infinities and NaN give NaN
    for (const Range& range : moved_) {
        const Index end = std::min(range.end(), vertices.end());
        for (Index v = std::max(range.first, vertices.first); v < end; ++v) {
            const double square = (frame.position.col(v) - last_.col(v)).squaredNorm();
            largest_square = std::max(largest_square, square);
            not_finite += 0.0 * square;
        }
    }
    tissue.largest_move = std::sqrt(largest_square);
    const double bound = margin_of(tissue.largest_move).x();
    tissue.blocks.move(not_finite == 0.0 ? bound : std::numeric_limits<double>::infinity());
    find_regions(topology, frame, tissue);
    tissue.blocks.collect(topology, frame.position, tissue.regions, tissue.near);
    tissue.grid.fill(topology, frame.position, tissue.near);
    tissue.whole = false;
}

void CrossingLedger::fill_whole(const Topology& topology, const Frame& frame, Tissue& tissue) {
    tissue.near.resize(at(topology.bodies[at(tissue.body)].triangles.count));
    std::iota(tissue.near.begin(), tissue.near.end(), topology.bodies[at(tissue.body)].triangles.first);
    tissue.grid.fill(topology, frame.position, tissue.near);
    tissue.whole = true;
}

void CrossingLedger::update(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                            const ContactSet& contacts) {
    if (!started_) {
        if (on_edges_) add_edge_samples(topology, frame);
        for (Tissue& tissue : tissues_) {
            tissue.blocks.refresh_all(frame.position);
            fill_whole(topology, frame, tissue);
        }
        link_samples(topology, surface);
        find_start(topology, frame, contacts);
        started_ = true;
        original_ = last_ = frame.position;
    } else {
        const bool known = frame.moved.has_value() && frame.tick == last_tick_ + 1;
        moved_.assign(1, Range{0, topology.vertex_count});
        if (known) moved_ = *frame.moved;
        for (Tissue& tissue : tissues_) {
            fill_near(topology, frame, tissue);
            count_crossings(topology, frame, tissue);
            if (tissue.closed) check_closed(topology, frame, tissue);
        }
    }
    last_tick_ = frame.tick;
    ++updates_;

    kept_.swap(penetrations_);
    penetrations_.clear();
    for (Tissue& tissue : tissues_) update_layers(topology, surface, frame, tissue);
    for (const Range& range : moved_) {
        last_.middleCols(range.first, range.count) = frame.position.middleCols(range.first, range.count);
    }
}

/// True where an edge of the body that passes through no tissue leads to a sample on its right side. Through both walls
/// of closed tissue at the start and then drawn out, a tool comes out by the wall that it never went in by: nothing but
/// the rest of the tool tells that it is free.
bool CrossingLedger::is_joined_to_right(std::size_t s, const Topology& topology, const SurfaceNeighbours& surface,
                                        const Frame& frame, Tissue& tissue) const {
    const LedgerSample& sample = samples_[s];
    const Vector3 from = sample.of(frame.position) + hair;
    const auto is_right = [&](Index vertex) {
        const Index u = sample_of_vertex_[at(vertex)];
        if (at(u) == s || tissue.count[at(u)] != 0) return false;
        const auto crossing = std::lower_bound(tissue.crossings.begin(), tissue.crossings.end(), u,
                                               [](const Crossing& one, Index number) { return one.sample < number; });
        if (crossing != tissue.crossings.end() && crossing->sample == u) return false;
        // Those with a smaller number are already this tick's.
        const std::vector<Penetration>& known = at(u) < s ? penetrations_ : kept_;
        const Range& range = tissue.layers[at(u)];
        for (Index layer = range.first; layer < range.end(); ++layer) {
            if (known[at(layer)].crossed != 0) return false;
        }
        const Vector3 to = frame.position.col(vertex) + hair;
        Box way;
        way.add(from);
        way.add(to);
        bool passes = false;
        tissue.grid.visit(way, [&](Index t) {
            const equations::Corners corners = corners_of(topology, frame.position, t);
            passes = passes || segment_crossing(from, to, corners[0], corners[1], corners[2]) != 0;
        });
        return !passes;
    };
    if (sample.other >= 0) return is_right(sample.vertex) || is_right(sample.other);
    for (const Index t : surface.triangles_at(sample.vertex)) {
        for (int i = 0; i < 3; ++i) {
            if (is_right(topology.triangles(i, t))) return true;
        }
    }
    return false;
}

/// Layers of the last tick that are still crossed, or near, keep their anchor.
void CrossingLedger::update_layers(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                                   Tissue& tissue) {
    const bool at_rim = !tissue.closed && free_rim_is_near(frame, tissue);
    std::fill(reach_.begin(), reach_.end(), Reach::unknown);
    if (at_rim) free_slipped(topology, frame, tissue);
    layers_.look_at(topology, surface, frame);
    auto crossing = tissue.crossings.begin();
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        Range& range = tissue.layers[s];
        const int count = tissue.count[s];
        const auto first = crossing;
        while (crossing != tissue.crossings.end() && at(crossing->sample) == s) ++crossing;
        const Range last = range;
        range = {static_cast<Index>(penetrations_.size()), 0};
        if (reach_[s] == Reach::freed || (last.count == 0 && first == crossing && count == 0)) continue;
        layers_.begin(samples_[s], tissue.body);
        for (Index layer = last.first; layer < last.end(); ++layer) layers_.keep(kept_[at(layer)]);
        for (auto c = first; c != crossing; ++c) layers_.cross(c->triangle, c->sign);
        layers_.cancel();
        if (count == 0 && layers_.any_crossed() && is_joined_to_right(s, topology, surface, frame, tissue)) {
            layers_.forget_crossings();
        }
        layers_.agree_with(count,
                           [&] { return nearest_triangle(topology, frame, tissue, samples_[s].of(frame.position)); });
        if (at_rim && is_solid(topology.bodies[at(samples_[s].body)])) {
            layers_.turn_outwards(outwards_at(samples_[s], topology, surface, frame), tissue.clear);
            repairs_ += layers_.crossings() != count ? 1 : 0;
            tissue.count[s] = static_cast<std::int16_t>(layers_.crossings());
        }
        // Where it has left the surface in this tick, the surface can follow it.
        const double way = (samples_[s].of(frame.position) - samples_[s].of(last_)).norm();
        layers_.append_to(penetrations_, tissue.margin + way);
        range.count = static_cast<Index>(penetrations_.size()) - range.first;
    }
}

}  // namespace trocar
