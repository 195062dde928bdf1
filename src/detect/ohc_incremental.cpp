#include "detect/ohc_incremental.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "detect/narrow_phase.hpp"
#include "method/frame_check.hpp"

namespace trocar {

void OhcIncremental::prepare(const Frame& frame) {
    list_triangles_of_vertices();
    following_.assign(bodies_.topology().bodies.size(), Following{});
    changed_at_.assign(at(bodies_.topology().triangle_count()), 0);
    change_ = 0;
    changed_.clear();
    to_hash_.assign(at(bodies_.topology().triangle_count()), 0);
    hash_again_.clear();
    last_.clear();
    last_pairs_.clear();
    last_near_.clear();
    known_ = false;
    answered_ = true;
    moving_ = false;
    if (!is_answerable(bodies_.topology(), frame)) return;
    // As a change that nobody has asked for yet.
    ++change_;
    answered_ = false;
    keep_all(frame);
}

/// Which triangles move when a vertex moves.
void OhcIncremental::list_triangles_of_vertices() {
    const Topology& topology = bodies_.topology();
    first_triangle_.assign(at(topology.vertex_count) + 1, 0);
    const Index* const corners = topology.triangles.data();
    for (Index i = 0; i < 3 * topology.triangle_count(); ++i) ++first_triangle_[at(corners[i]) + 1];
    std::partial_sum(first_triangle_.begin(), first_triangle_.end(), first_triangle_.begin());
    triangles_of_vertices_.resize(3 * at(topology.triangle_count()));
    std::vector<Index> next(first_triangle_.begin(), first_triangle_.end() - 1);
    for (Index t = 0; t < topology.triangle_count(); ++t) {
        for (int k = 0; k < 3; ++k) triangles_of_vertices_[at(next[at(topology.triangles(k, t))]++)] = t;
    }
}

bool OhcIncremental::follow(const Frame& frame) {
    // Ranges told by later frames start from a frame that was followed.
    const bool told = std::exchange(known_, false) && frame.moved.has_value();
    if (frame.position.cols() != bodies_.topology().vertex_count) return false;
    if (answered_) {
        ++change_;
        changed_.clear();
        moving_ = false;
        answered_ = false;
    }
    redo_ = false;
    if (last_.empty() || !bodies_.has_cell() || kept_reach_ != bodies_.reach()) {
        known_ = is_answerable(bodies_.topology(), frame);
        if (known_) keep_all(frame);
        return known_;
    }
    known_ = look_at_bodies(frame, told) && look_at_vertices(frame, told);
    if (!known_) return false;
    bodies_.choose_active();
    if (!rehash(frame) || (!bodies_.active().empty() && !bodies_.place_on_lattice())) {
        keep_all(frame);
        return true;
    }
    redo_ = !bodies_.active().empty() && (moving_ || changed_near_moving());
    occupancy_.clear();
    if (!redo_) return true;
    const CellRange meeting = bodies_.place_groups();
    if (bodies_.active().size() > 1 && !is_empty(meeting)) occupancy_.find(frame, meeting);
    return true;
}

/// Which bodies move as a whole, in part or not at all. False when a number is not finite.
bool OhcIncremental::look_at_bodies(const Frame& frame, bool told) {
    const Topology& topology = bodies_.topology();
    for (std::size_t body = 0; body < following_.size(); ++body) {
        following_[body].asked = told ? 0 : topology.bodies[body].vertices.count;
    }
    if (told) {
        for_each_told(topology, frame, [this](Index body, Range part) { following_[at(body)].asked += part.count; });
    }
    leaving_.clear();
    bool finite = true;
    for (Index body = 0; body < topology.body_count(); ++body) {
        Following& state = following_[at(body)];
        const Range vertices = bodies_.body(body).vertices;
        if (state.asked == 0 && (is_kept(body) || told)) {
            if (!is_kept(body)) ++state.calm;
        } else if (is_kept(body)) {
            if (2 * state.asked > vertices.count && last_.most_samples_moved(frame, vertices)) leaving_.push_back(body);
        } else {
            const std::int64_t moved = told ? state.asked : last_.count_moved(frame, vertices);
            state.moved = state.moved || moved > 0;
            state.calm = 2 * moved > vertices.count ? 0 : state.calm + 1;
            work_.counters.vertices_read += vertices.count;
            if (moved > 0) finite &= bodies_.read_box(frame, body);
            moving_ = moving_ || (moved > 0 && bodies_.takes_part(body));
        }
    }
    for (const Index body : leaving_) {
        finite &= bodies_.read_box(frame, body);
        bodies_.keep(body, false);
        following_[at(body)] = {.moved = true};
        work_.counters.vertices_read += bodies_.body(body).vertices.count;
        moving_ = true;
    }
    if (!leaving_.empty()) forget_leaving(frame);
    if (!finite) return false;
    for (const Index body : bodies_.order()) {
        if (is_kept(body) || following_[at(body)].calm < patience) continue;
        bodies_.keep(body, true);
        following_[at(body)] = {};
        const BodyRange& range = bodies_.body(body);
        last_.remember(frame, range.vertices);
        for (Index t = range.triangles.first; t < range.triangles.end(); ++t) {
            change(t);
            hash_again(t);
        }
    }
    return true;
}

/// The maps without the bodies that move as a whole from this tick on.
void OhcIncremental::forget_leaving(const Frame& frame) {
    std::int64_t leaving = 0;
    std::int64_t staying = 0;
    for (const Index body : leaving_) leaving += bodies_.body(body).triangles.count;
    for (const Index body : bodies_.order()) {
        if (is_kept(body)) staying += bodies_.body(body).triangles.count;
    }
    if (leaving <= staying) {
        for (const Index body : leaving_) {
            const Range triangles = bodies_.body(body).triangles;
            for (Index t = triangles.first; t < triangles.end(); ++t) {
                work_.counters.cells_visited += kept_.take(t);
            }
        }
        return;
    }
    kept_.start(bodies_.topology().triangle_count(), settings_.hash, settings_.hash_bits);
    for (const Index body : bodies_.order()) {
        if (!is_kept(body)) continue;
        const Range triangles = bodies_.body(body).triangles;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            work_.counters.cells_visited += kept_.put(frame, bodies_.cells(), bodies_.cells().primitive(frame, t));
        }
    }
}

/// Which triangles of kept bodies moved. False when a number is not finite.
bool OhcIncremental::look_at_vertices(const Frame& frame, bool told) {
    if (told) {
        bool finite = true;
        for_each_told(bodies_.topology(), frame, [&](Index body, Range part) {
            if (is_kept(body) && finite) finite = look_at_range(frame, body, part);
        });
        return finite;
    }
    for (const Index body : bodies_.order()) {
        if (is_kept(body) && !look_at_range(frame, body, bodies_.body(body).vertices)) return false;
    }
    return true;
}

bool OhcIncremental::look_at_range(const Frame& frame, Index body, Range range) {
    const double around = bodies_.cells().around(body);
    work_.counters.vertices_read += range.count;
    for (Index v = range.first; v < range.end(); ++v) {
        if (!last_.moved(frame, v)) continue;
        if (!frame.position.col(v).allFinite()) return false;
        const bool other_cell = changes_cell(frame, v, around);
        last_.remember(frame, v);
        for (Index k = first_triangle_[at(v)]; k < first_triangle_[at(v) + 1]; ++k) {
            const Index t = triangles_of_vertices_[at(k)];
            change(t);
            if (other_cell || !kept_.is_whole(t)) hash_again(t);
        }
    }
    return true;
}

/// Whether a triangle with `around` (m) around it may leave or enter a cell by this corner's step.
bool OhcIncremental::changes_cell(const Frame& frame, Index vertex, double around) const {
    const Lattice& lattice = bodies_.cells().lattice();
    const double* const before = last_.before(vertex);
    for (int axis = 0; axis < 3; ++axis) {
        const double now = frame.position(axis, vertex);
        if (lattice.number(before[axis] - around, axis) != lattice.number(now - around, axis)) return true;
        if (around == 0.0) continue;
        if (lattice.number(before[axis] + around, axis) != lattice.number(now + around, axis)) return true;
    }
    return false;
}

void OhcIncremental::change(Index triangle) {
    if (std::exchange(changed_at_[at(triangle)], change_) != change_) changed_.push_back(triangle);
}

void OhcIncremental::hash_again(Index triangle) {
    if (std::exchange(to_hash_[at(triangle)], std::uint8_t{1}) == 0) hash_again_.push_back(triangle);
}

/// All triangles into empty maps: at the first frame, at another reach, and when a kept one left the lattice.
void OhcIncremental::keep_all(const Frame& frame) {
    if (!bodies_.has_cell()) bodies_.choose_cell(frame);
    kept_reach_ = bodies_.reach();
    (void)bodies_.read_boxes(frame);
    for (Following& state : following_) state = {};
    for (const Index body : bodies_.order()) bodies_.keep(body, false);
    bodies_.choose_active();
    bodies_.place_groups();
    for (const Index body : bodies_.order()) bodies_.keep(body, true);
    bodies_.choose_active();
    last_.remember_all(frame);
    work_.counters.vertices_read += bodies_.topology().vertex_count;
    kept_.start(bodies_.topology().triangle_count(), settings_.hash, settings_.hash_bits);
    occupancy_.clear();
    for (const Index body : bodies_.order()) {
        const Range triangles = bodies_.body(body).triangles;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            change(t);
            hash_again(t);
        }
    }
    (void)rehash(frame);
}

/// False when a triangle is beyond the lattice, whose corner may have been chosen elsewhere.
bool OhcIncremental::rehash(const Frame& frame) {
    bool inside = true;
    for (const Index t : hash_again_) {
        to_hash_[at(t)] = 0;
        if (!is_kept(bodies_.body_of(t))) continue;  // changed first and moved on with its whole body
        const Primitive p = bodies_.cells().primitive(frame, t);
        inside = inside && !Lattice::at_limit(p.range);
        work_.counters.cells_visited += kept_.put(frame, bodies_.cells(), p);
    }
    hash_again_.clear();
    return inside;
}

/// Whether a kept triangle moved where a body is that goes through the cascade.
bool OhcIncremental::changed_near_moving() const {
    return std::any_of(changed_.begin(), changed_.end(), [this](Index t) {
        if (!is_kept(bodies_.body_of(t)) || kept_.is_huge(t)) return true;
        return std::any_of(bodies_.active().begin(), bodies_.active().end(),
                           [&](const OhcBodies::Group& group) { return group.range.overlaps(kept_.range(t)); });
    });
}

void OhcIncremental::detect(const Frame& frame, OhcCandidates& candidates, ContactSet& contacts) {
    candidates.clear();
    const auto stays = [this](Index t) {
        return changed_at_[at(t)] != change_ && !(redo_ && !is_kept(bodies_.body_of(t)));
    };
    const auto keep = [&stays](const std::vector<TrianglePair>& last, std::vector<TrianglePair>& pairs) {
        for (const TrianglePair& pair : last) {
            if (stays(pair.a) && stays(pair.b)) pairs.push_back(pair);
        }
    };
    keep(last_pairs_, contacts.pairs);
    keep(last_near_, contacts.near);
    if (redo_) {
        maps_.hash(frame);
        maps_.gather(
            OhcMaps::any_bodies, [] { return true; }, candidates);
        maps_.gather_huge(frame, OhcMaps::any_bodies, candidates);
        ask_kept(frame, candidates);
    }
    look_around_changed(frame, candidates);
    look_around_huge(frame, stays, candidates);
    candidates.settle();
    work_.counters.triangle_tests += static_cast<std::int64_t>(candidates.once.size());
    work_.counters.triangle_tests += test_pairs_within(bodies_.reach(), settings_.test, bodies_.topology(), frame,
                                                       candidates.once, contacts.pairs, contacts.near);
    last_pairs_ = contacts.pairs;
    last_near_ = contacts.near;
    answered_ = true;
}

/// Triangles of bodies that are not kept against those that are.
void OhcIncremental::ask_kept(const Frame& frame, OhcCandidates& candidates) {
    const std::vector<Index>& order = bodies_.order();
    if (std::none_of(order.begin(), order.end(), [this](Index body) { return is_kept(body); })) return;
    kept_.cover(bodies_.cells().lattice());
    for (const OhcBodies::Group& group : bodies_.active()) {
        if (!kept_.any_near(group.range) && kept_.huge().empty()) continue;
        bodies_.for_each_body(group, [&](const BodyRange& body) {
            work_.counters.cells_visited += body.triangles.count;
            for (Index t = body.triangles.first; t < body.triangles.end(); ++t) ask_kept(frame, t, candidates);
        });
    }
}

void OhcIncremental::ask_kept(const Frame& frame, Index triangle, OhcCandidates& candidates) {
    const Primitive p = bodies_.cells().primitive(frame, triangle);
    if (!kept_.any_near(p.range)) return;
    const bool placed = bodies_.cells().for_each_range(frame, p, [&](const CellRange& part) {
        work_.counters.cells_visited +=
            kept_.for_each_in(part, [&](const std::array<std::int32_t, 3>& cell, Index body, std::int32_t first) {
                if (!bodies_.may_hit(p.body, body)) return;
                kept_.for_each_triangle(first, [&](Index other) { meet_kept(frame, p, cell, other, candidates); });
            });
    });
    if (placed) return;
    for (const Index body : bodies_.order()) {
        if (!bodies_.may_hit(p.body, body) || !is_kept(body)) continue;
        const Range others = bodies_.body(body).triangles;
        work_.counters.box_tests += others.count;
        for (Index other = others.first; other < others.end(); ++other) {
            OhcCandidates::add(p, bodies_.cells().primitive(frame, other), candidates.repeated);
        }
    }
}

/// A triangle and a kept one in one cell.
void OhcIncremental::meet_kept(const Frame& frame, const Primitive& p, const std::array<std::int32_t, 3>& cell,
                               Index other, OhcCandidates& candidates) {
    ++work_.counters.box_tests;
    const CellRange& range = kept_.range(other);
    const bool cut = p.cut || kept_.is_cut(other);
    if (!cut &&
        (cell[0] != std::max(p.range.low[0], range.low[0]) || cell[1] != std::max(p.range.low[1], range.low[1]) ||
         cell[2] != std::max(p.range.low[2], range.low[2]))) {
        return;
    }
    OhcCandidates::add(p, bodies_.cells().primitive(frame, other), cut ? candidates.repeated : candidates.once);
}

/// Kept triangles that moved against all kept ones.
void OhcIncremental::look_around_changed(const Frame& frame, OhcCandidates& candidates) {
    // With one group there is nobody to meet.
    const std::vector<OhcBodies::Group>& groups = bodies_.groups();
    const auto kept_groups = std::count_if(groups.begin(), groups.end(), [this](const OhcBodies::Group& group) {
        return std::any_of(bodies_.order().begin() + static_cast<std::ptrdiff_t>(group.first_body),
                           bodies_.order().begin() + static_cast<std::ptrdiff_t>(group.end_body),
                           [this](Index body) { return is_kept(body); });
    });
    if (kept_groups < 2) return;
    for (const Index t : changed_) {
        const Index own = bodies_.body_of(t);
        if (!is_kept(own) || kept_.is_huge(t)) continue;
        const Primitive p = bodies_.cells().primitive(frame, t);
        work_.counters.cells_visited +=
            kept_.for_each_neighbour(t, [&](const std::array<std::int32_t, 3>& cell, Index body, std::int32_t first) {
                if (!bodies_.may_hit(own, body)) return;
                kept_.for_each_triangle(first, [&](Index other) {
                    if (changed_at_[at(other)] == change_ && body < own) return;  // found from there
                    meet_kept(frame, p, cell, other, candidates);
                });
            });
    }
}

/// Kept triangles that are in no cell against all others, of which one of the two moved.
template <typename Stays>
void OhcIncremental::look_around_huge(const Frame& frame, const Stays& stays, OhcCandidates& candidates) {
    const TriangleCells& cells = bodies_.cells();
    for (const Index t : kept_.huge()) {
        const Primitive p = cells.primitive(frame, t);
        const auto look_at = [&](Index other) {
            if (stays(t) && stays(other)) return;
            ++work_.counters.box_tests;
            OhcCandidates::add(p, cells.primitive(frame, other), candidates.repeated);
        };
        const bool all = !stays(t) || redo_;
        if (!all) {
            for (const Index other : changed_) {
                if (bodies_.may_hit(p.body, bodies_.body_of(other))) look_at(other);
            }
            continue;
        }
        for (const Index body : bodies_.order()) {
            if (!bodies_.may_hit(p.body, body)) continue;
            const Range triangles = bodies_.body(body).triangles;
            for (Index other = triangles.first; other < triangles.end(); ++other) look_at(other);
        }
    }
}

}  // namespace trocar
