#include "respond/back_projection.hpp"

#include <algorithm>
#include <cmath>

#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr Index block_size = 16;  // consecutive vertices or triangles, which in most meshes lie together

Box box_of(const Matrix3X& position, Range range) {
    using TwoPoints = Eigen::Array<double, 6, 1>;  // a whole number of registers
    const double* point = position.data() + 3 * static_cast<std::ptrdiff_t>(range.first);
    Box box;
    TwoPoints low = TwoPoints::Constant(box.min[0]);
    TwoPoints high = TwoPoints::Constant(box.max[0]);
    for (Index i = 0; i + 1 < range.count; i += 2, point += 6) {
        const Eigen::Map<const TwoPoints> here(point);
        low = low.min(here);
        high = high.max(here);
    }
    box.min = low.head<3>().min(low.tail<3>());
    box.max = high.head<3>().max(high.tail<3>());
    if (range.count % 2 == 1) box.add(position.col(range.end() - 1));
    return box;
}

/// One bit for each side of `bounds` that what lies between `low` and `high` is beyond.
std::uint8_t sides_beyond(const Box& bounds, const double* low, const double* high) {
    unsigned bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
        bits |= static_cast<unsigned>(high[axis] < bounds.min[axis]) << (2 * axis);
        bits |= static_cast<unsigned>(low[axis] > bounds.max[axis]) << (2 * axis + 1);
    }
    return static_cast<std::uint8_t>(bits);
}

/// Where a vertex was n_back ticks ago had it always moved as fast, or as far back as l_max reaches.
inline Vector3 came_from(const ThesisState& state, const Frame& frame, Index vertex) {
    const Vector3 v = frame.velocity.col(vertex);
    const double l_max = state.settings.l_max;
    double time = state.settings.n_back * state.dt;
    const double speed_squared = v.squaredNorm();
    if (speed_squared * time * time > l_max * l_max) time = l_max / std::sqrt(speed_squared);
    return frame.position.col(vertex) - time * v;
}

/// Where a vertex of these has to be for its path to reach `target`: none goes back for longer than n_back ticks.
Box box_to_start_from(const ThesisState& state, const Frame& frame, Range vertices, const Box& target) {
    const Box velocity = box_of(frame.velocity, vertices);
    const double time = state.settings.n_back * state.dt;
    const Vector3 rounding = 1e-12 * (target.max.cwiseAbs() + target.min.cwiseAbs());
    return {.min = target.min + (time * velocity.min).cwiseMin(0.0) - rounding,
            .max = target.max + (time * velocity.max).cwiseMax(0.0) + rounding};
}

/// Calls act(part) for runs of block_size elements, the last of which may be shorter.
template <typename Act>
void each_block(Range range, const Act& act) {
    for (Index first = range.first; first < range.end(); first += block_size) {
        act(Range{first, std::min(block_size, range.end() - first)});
    }
}

}  // namespace

void BackProjection::prepare(const Topology& topology) {
    beyond_.assign(at(topology.vertex_count), 0);
    vertex_blocks_.clear();
    triangle_blocks_.clear();
    blocks_of_triangles_.clear();
    std::vector<Index> block_of_vertex(at(topology.vertex_count), -1);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        each_block(body.vertices, [&](Range vertices) {
            const auto number = static_cast<Index>(vertex_blocks_.size());
            std::fill_n(block_of_vertex.begin() + vertices.first, vertices.count, number);
            vertex_blocks_.push_back({.vertices = vertices});
        });
        each_block(body.triangles, [&](Range triangles) {
            std::vector<Index> blocks;
            for (Index t = triangles.first; t < triangles.end(); ++t) {
                for (int i = 0; i < 3; ++i) blocks.push_back(block_of_vertex[at(topology.triangles(i, t))]);
            }
            std::sort(blocks.begin(), blocks.end());
            blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
            triangle_blocks_.push_back(
                {triangles, {static_cast<Index>(blocks_of_triangles_.size()), static_cast<Index>(blocks.size())}});
            blocks_of_triangles_.insert(blocks_of_triangles_.end(), blocks.begin(), blocks.end());
        });
    }
}

void BackProjection::respond(const ThesisState& state, const Frame& frame, Effect& effect) {
    collect_paths(state, frame);
    if (paths_.empty()) return;
    collect_near(*state.topology, frame);
    for (std::size_t first = 0; first < paths_.size(); first += PathSlabs::most_paths) {
        const std::span<Path> some =
            std::span(paths_).subspan(first).first(std::min(PathSlabs::most_paths, paths_.size() - first));
        meet_triangles(some);
        for (const Path& path : some) {
            attracted_.clear();
            // The first triangle of a vertex says how deep it is.
            for (Index m = path.first_met; m >= 0; m = met_[at(m)].next) {
                attract(state, frame, path, met_[at(m)].triangle, effect);
            }
        }
    }
}

/// Paths that reach the box of all tissue.
void BackProjection::collect_paths(const ThesisState& state, const Frame& frame) {
    Box tissue;
    for (VertexBlock& block : vertex_blocks_) {
        block.box = box_of(frame.position, block.vertices);
        tissue.add(block.box.min);
        tissue.add(block.box.max);
    }
    paths_.clear();
    bounds_ = Box{};
    for (Index body = 0; body < state.topology->body_count(); ++body) {
        if (state.kind(body) != BodyKind::instrument) continue;
        each_block(state.topology->bodies[at(body)].vertices, [&](Range vertices) {
            const Box start = box_to_start_from(state, frame, vertices, tissue);
            for (Index a = vertices.first; a < vertices.end(); ++a) {
                const Vector3 x = frame.position.col(a);
                if (!start.overlaps({.min = x, .max = x}) || frame.velocity.col(a) == Vector3::Zero()) continue;
                const Vector3 from = came_from(state, frame, a);
                const Box box{.min = x.cwiseMin(from), .max = x.cwiseMax(from)};
                if (!box.overlaps(tissue)) continue;
                bounds_.add(box.min);
                bounds_.add(box.max);
                paths_.push_back({.body = body, .vertex = a, .from = from, .box = box});
            }
        });
    }
}

/// Tissue triangles whose boxes meet that of all paths.
void BackProjection::collect_near(const Topology& topology, const Frame& frame) {
    near_.clear();
    for (VertexBlock& block : vertex_blocks_) {
        block.beyond = sides_beyond(bounds_, block.box.min.data(), block.box.max.data());
        const Range vertices = block.vertices;
        if (block.beyond != 0) {
            std::fill_n(beyond_.begin() + vertices.first, vertices.count, block.beyond);
            continue;
        }
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            const double* point = frame.position.col(v).data();
            beyond_[at(v)] = sides_beyond(bounds_, point, point);
        }
    }
    for (const TriangleBlock& block : triangle_blocks_) {
        unsigned all_beyond = ~0U;
        for (Index b = block.blocks.first; b < block.blocks.end(); ++b) {
            all_beyond &= vertex_blocks_[at(blocks_of_triangles_[at(b)])].beyond;
        }
        if (all_beyond != 0) continue;
        for (Index t = block.triangles.first; t < block.triangles.end(); ++t) {
            const auto corner = topology.triangles.col(t);
            if ((beyond_[at(corner[0])] & beyond_[at(corner[1])] & beyond_[at(corner[2])]) != 0) continue;
            const Vector3 p = frame.position.col(corner[0]);
            const Vector3 q = frame.position.col(corner[1]);
            const Vector3 r = frame.position.col(corner[2]);
            const Box box{.min = p.cwiseMin(q).cwiseMin(r), .max = p.cwiseMax(q).cwiseMax(r)};
            near_.push_back({.triangle = t, .box = box});
        }
    }
}

/// Notes for each of these paths which near triangles' boxes meet its own.
void BackProjection::meet_triangles(std::span<Path> paths) {
    slabs_.prepare(paths);
    met_.clear();
    for (const NearTriangle& near : near_) {
        if (!near.box.overlaps(slabs_.bounds())) continue;
        slabs_.visit(near.box, [&](std::size_t p) {
            Path& path = paths[p];
            if (!near.box.overlaps(path.box)) return;
            const auto here = static_cast<Index>(met_.size());
            met_.push_back({.triangle = near.triangle});
            (path.first_met < 0 ? path.first_met : met_[at(path.last_met)].next) = here;
            path.last_met = here;
        });
    }
}

void BackProjection::PathSlabs::prepare(std::span<const Path> paths) {
    used_ = (paths.size() + 63) / 64;
    bounds_ = Box{};
    for (const Path& path : paths) {
        bounds_.add(path.box.min);
        bounds_.add(path.box.max);
    }
    per_slab_ = static_cast<double>(slabs) * (bounds_.max - bounds_.min).cwiseMax(1e-300).cwiseInverse();
    for (std::size_t axis = 0; axis < 3; ++axis) {
        begun_[axis].fill({});
        ended_[axis].fill({});
    }
    for (std::size_t p = 0; p < paths.size(); ++p) {
        const std::uint64_t bit = std::uint64_t{1} << (p % 64);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            begun_[axis][slab_of(axis, paths[p].box.min)][p / 64] |= bit;
            ended_[axis][slab_of(axis, paths[p].box.max) + 1][p / 64] |= bit;
        }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t slab = 1; slab < slabs; ++slab) {
            for (std::size_t w = 0; w < used_; ++w) {
                begun_[axis][slab][w] |= begun_[axis][slab - 1][w];
                ended_[axis][slab][w] |= ended_[axis][slab - 1][w];
            }
        }
    }
}

void BackProjection::attract(const ThesisState& state, const Frame& frame, const Path& path, Index triangle,
                             Effect& effect) {
    const Topology& topology = *state.topology;
    if (topology.body_pair(path.body, topology.body_of_triangle[at(triangle)]) < 0) return;
    const Vector3 x = frame.position.col(path.vertex);
    const equations::Corners corners = corners_of(topology, frame.position, triangle);
    const equations::PathHit hit = equations::path_hit(corners, path.from, x);
    if (!hit.found || !hit.point.allFinite()) return;  // not finite: a corner is not
    const Index vertex = topology.triangles(equations::nearest_corner(corners, hit.point), triangle);
    if (std::find(attracted_.begin(), attracted_.end(), vertex) != attracted_.end()) return;
    attracted_.push_back(vertex);
    const Vector3 towards = x - frame.position.col(vertex);
    const double distance = towards.norm();
    if (distance == 0.0) return;
    LinearContact linear;
    linear.vertices = {vertex, -1, -1};
    linear.weights = {1.0, 0.0, 0.0};
    linear.normal = towards / distance;
    linear.gap = -(x - hit.point).norm();
    linear.k = state.materials->mean_stiffness[at(vertex)];
    linear.face_velocity = frame.velocity.col(path.vertex).dot(linear.normal);
    linear.adhesive = true;
    linear.reaction_body = path.body;
    linear.reaction_point = x;
    tell_at_start(topology, frame, state.dt, linear);
    effect.contacts.push_back(linear);
}

}  // namespace trocar
