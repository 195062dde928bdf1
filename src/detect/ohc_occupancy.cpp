#include "detect/ohc_occupancy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace trocar {

void OhcOccupancy::prepare(std::size_t room) {
    near_.prepare(bodies_.topology().vertex_count);
    shared_.prepare(0);
    sides_.assign(static_cast<std::size_t>(bodies_.topology().vertex_count), 0);
    found_.reserve(room);
    huge_.reserve(room);
    primitives_.reserve(room);
    runs_.reserve(bodies_.groups().size());
    clear();
}

void OhcOccupancy::clear() {
    huge_.clear();
    primitives_.clear();
    entries_ = 0;
}

void OhcOccupancy::find(const Frame& frame, const CellRange& meeting) {
    clear();
    find_near(frame, meeting);
    std::sort(huge_.begin(), huge_.end());
    huge_.erase(std::unique(huge_.begin(), huge_.end()), huge_.end());
    find_shared(frame);
}

/// Fills huge_, and primitives_ with the triangles near cells that two groups may share.
void OhcOccupancy::find_near(const Frame& frame, const CellRange& meeting) {
    const std::vector<Group>& groups = bodies_.groups();
    const std::size_t last = groups.size() - 1;
    runs_.assign(groups.size(), Run{});
    double around = 0.0;
    for (const Group& group : groups) around = std::max(around, bodies_.around(group));
    near_.start(bodies_.cells().lattice(), meeting, around);
    plain_ = !bodies_.cells().path() && near_.spread_for(around) <= Occupancy::most_spread;
    for (std::size_t g = 0; g < last; ++g) put_in_field(frame, groups[g]);
    if (plain_) near_.search_for_any(spread_of(groups[last]));
    collect(frame, last, [this](const CellRange& range) { return near_.share(range); });
    if (primitives_.empty() && groups.size() == 2) return;
    int searched_for = 0;
    for (std::size_t g = 0; g < last; ++g) {
        if (!near_.any_shared(groups[g].range)) continue;
        if (plain_ && std::exchange(searched_for, spread_of(groups[g])) != spread_of(groups[g])) {
            near_.search_for_shared(spread_of(groups[g]));
        }
        collect(frame, g, [this](const CellRange& range) { return near_.any_shared(range); });
    }
}

/// Enters all vertices of the group, and those triangles that may meet others and extend more than one cell from their
/// vertices.
void OhcOccupancy::put_in_field(const Frame& frame, const Group& group) {
    const TriangleCells& cells = bodies_.cells();
    found_.clear();
    bodies_.for_each_body(group, [&](const BodyRange& body) {
        if (!bodies_.meeting().any(bodies_.body_of(body.triangles.first))) return;  // meets no other body
        if (!work_.spend(work_.counters.cells_visited, body.triangles.count)) return;
        if (!plain_) {
            add_all(body.triangles);
            return;
        }
        near_.encode(frame, body.vertices);
        near_.add_vertices(body.vertices);
        near_.collect_wide(bodies_.topology().triangles.data(), body.triangles, found_);
    });
    if (!work_.spend(work_.counters.box_tests, static_cast<std::int64_t>(found_.size()))) found_.clear();
    for (const Index t : found_) {
        const Primitive primitive = cells.primitive(frame, t);
        if (!bodies_.meeting().may_meet(primitive)) continue;
        const bool placed = cells.for_each_range(frame, primitive, [this](const CellRange& range) {
            if (work_.afford(range)) work_.counters.cells_visited += near_.add(range);
        });
        if (!placed) huge_.push_back(t);
    }
    near_.merge(group.range, plain_ ? spread_of(group) : 0);
}

/// Appends the group's triangles that their vertices do not rule out, that may meet another body, and that have a cell
/// with `is_shared`.
template <typename IsShared>
void OhcOccupancy::collect(const Frame& frame, std::size_t group, const IsShared& is_shared) {
    const TriangleCells& cells = bodies_.cells();
    found_.clear();
    const bool last = group + 1 == bodies_.groups().size();
    bodies_.for_each_body(bodies_.groups()[group], [&](const BodyRange& body) {
        if (!bodies_.meeting().any(bodies_.body_of(body.triangles.first))) return;  // meets no other body
        if (!work_.spend(work_.counters.cells_visited, body.triangles.count)) return;
        if (!plain_) {
            add_all(body.triangles);
            return;
        }
        if (last) near_.encode(frame, body.vertices);
        near_.mark(body.vertices);
        const std::size_t before = found_.size();
        near_.collect(bodies_.topology().triangles.data(), body.triangles, found_);
        // Where marks rule out little, a test of the corners costs less than a box.
        if (4 * (found_.size() - before) > static_cast<std::size_t>(body.triangles.count)) {
            keep_meeting(frame, body, before);
        }
    });
    // All boxes first, then the unpredictable branches, so that memory reads do not wait for them.
    const std::size_t first = primitives_.size();
    std::size_t kept = first;
    if (!work_.spend(work_.counters.box_tests, static_cast<std::int64_t>(found_.size()))) found_.clear();
    primitives_.resize(first + found_.size());
    std::size_t meeting = first;
    for (const Index t : found_) {
        primitives_[meeting] = cells.primitive(frame, t);
        meeting += bodies_.meeting().may_meet(primitives_[meeting]) ? 1 : 0;
    }
    primitives_.resize(meeting);
    for (std::size_t k = kept; k < primitives_.size(); ++k) {
        const Primitive& primitive = primitives_[k];
        bool shared = false;
        const bool placed = cells.for_each_range(frame, primitive, [&](const CellRange& range) {
            if (!work_.afford(range)) return;
            ++work_.counters.cells_visited;
            shared = is_shared(range) || shared;
        });
        if (!placed) huge_.push_back(primitive.triangle);  // a coarse cell may hold all of a huge triangle
        if (shared) primitives_[kept++] = primitive;
    }
    primitives_.resize(kept);
    runs_[group] = {first, kept};
}

/// Removes from found_, from `first` on, the triangles of `body` that cannot meet others.
void OhcOccupancy::keep_meeting(const Frame& frame, const BodyRange& body, std::size_t first) {
    if (!work_.spend(work_.counters.box_tests, static_cast<std::int64_t>(found_.size() - first))) return;
    const auto vertex = static_cast<std::size_t>(body.vertices.first);
    const Index number = bodies_.body_of(body.triangles.first);
    // The margin is added to the parts instead of the triangles, with more than the rounding of a subtraction.
    std::array<Extent, box_sides::most> parts;
    const std::span<const Extent> exact = bodies_.meeting().of(number);
    const double around = bodies_.cells().around(number);
    for (std::size_t k = 0; k < exact.size(); ++k) {
        parts[k] = exact[k];
        if (around == 0.0) continue;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            parts[k].low[axis] -= around + 0x1p-50 * (around + std::abs(parts[k].low[axis]));
            parts[k].high[axis] += around + 0x1p-50 * (around + std::abs(parts[k].high[axis]));
        }
    }
    kernels_.beside(frame.position.data() + 3 * vertex, body.vertices.count, {parts.data(), exact.size()},
                    sides_.data() + vertex);
    const auto sides = [this](Index v) { return sides_[static_cast<std::size_t>(v)]; };
    std::size_t kept = first;
    for (std::size_t k = first; k < found_.size(); ++k) {
        const Index* const corner = bodies_.topology().triangles.data() + 3 * static_cast<std::size_t>(found_[k]);
        found_[kept] = found_[k];
        kept += box_sides::any_overlap(sides(corner[0]), sides(corner[1]), sides(corner[2])) ? 1 : 0;
    }
    found_.resize(kept);
}

/// Repeats the test for the remaining triangles, with their exact cells.
void OhcOccupancy::find_shared(const Frame& frame) {
    const TriangleCells& cells = bodies_.cells();
    const CellRange range = near_.shared_range();
    if (is_empty(range)) {
        primitives_.clear();
        return;
    }
    shared_.start(cells.lattice(), range);
    const auto for_each_range = [&](std::size_t group, const auto& use) {
        for (std::size_t k = runs_[group].first; k < runs_[group].end; ++k) {
            cells.for_each_range(frame, primitives_[k], use);
        }
    };
    const std::size_t last = runs_.size() - 1;
    for (std::size_t g = 0; g < last; ++g) {
        for_each_range(g, [this](const CellRange& part) {
            if (work_.afford(part)) work_.counters.cells_visited += shared_.add(part);
        });
        shared_.merge(bodies_.groups()[g].range, 0);
    }
    for_each_range(last, [this](const CellRange& part) {
        if (!work_.afford(part)) return;
        ++work_.counters.cells_visited;
        shared_.share(part);
    });
    std::size_t left = 0;
    for (const Primitive& primitive : primitives_) {
        std::size_t count = 0;
        for_each_shared_cell(frame, primitive, [&count](Cell) { ++count; });
        if (count == 0) continue;
        entries_ += count;
        primitives_[left++] = primitive;
    }
    primitives_.resize(left);
}

}  // namespace trocar
