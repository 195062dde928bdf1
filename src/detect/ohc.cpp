// ohc: the detector that the thesis describes (§3.3, §4.2), as METHODS §2 reconstructs it. Space is split into equal
// cells, no mesh connectivity is used, and no body is ever held against another body: the work grows with the
// triangles, not with the pairs of bodies. A tick is a cascade, each level passing on only what it could not rule out:
//
//   boxes of bodies  where can two groups of bodies meet at all; the cells there are the window of this tick
//   occupancy        per group one bit per cell of the window, from the vertices; a triangle is ruled out by a look at
//                    three numbers, one per corner (occupancy.hpp). Nearly all triangles end here
//   shared cells     the same bits again for the triangles left, with the cells that they really cover       [update]
//   cell map         what lies in cells of two groups is hashed; a cell with two bodies that may collide is live
//   object map       the bodies in each live cell
//   primitive map    their triangles in each live cell (all three: cell_map.hpp)                             [detect]
//   boxes            triangles that share a live cell and whose boxes overlap; the pair counts in one cell only, the
//   one
//                    whose numbers are the larger of the two triangles' lowest numbers, so that no pair comes twice
//   triangles        the exact test (narrow_phase.hpp)
//
// Why no pair is missed: lattice.hpp. Triangles that span very many cells are cut into pieces for marking and hashing
// only (triangle_cells.hpp; they come repeatedly, which a sort undoes); those that would need more pieces than a plain
// look at every other triangle costs are looked at in that plain way.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "detect/cell_map.hpp"
#include "detect/cluster_kernels.hpp"
#include "detect/lattice.hpp"
#include "detect/narrow_phase.hpp"
#include "detect/occupancy.hpp"
#include "detect/pair_sort.hpp"
#include "detect/shared_parameters.hpp"
#include "detect/standing_map.hpp"
#include "detect/swept.hpp"
#include "detect/triangle_cells.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

struct Settings {
    double cell = std::numeric_limits<double>::quiet_NaN();  ///< m; NaN: chosen from the first frame
    CellHash hash = CellHash::fibonacci;
    int hash_bits = 12;
    double margin = 0.0;  ///< m
    bool incremental = false;
    bool swept = false;  ///< boxes hold the triangle at both ends of the tick
    TriangleTest test = TriangleTest::exact;
    std::int64_t max_pairs = std::numeric_limits<std::int64_t>::max();
    std::int64_t work_budget = std::numeric_limits<std::int64_t>::max();
    [[nodiscard]] bool limited() const {
        return max_pairs != std::numeric_limits<std::int64_t>::max() ||
               work_budget != std::numeric_limits<std::int64_t>::max();
    }
};

/// Bodies that may hit the same others and not each other, and their triangles near places where groups may meet.
struct Group {
    std::size_t first_body;  ///< of the list of bodies that take part
    std::size_t end_body;
    std::size_t first = 0;  ///< of the list of primitives
    std::size_t end = 0;
    CellRange range{};
};

/// What the primitive map needs of a triangle, in one cache line. Boxes overlap when each of one's lows is at most the
/// other's high; with highs negated that is one comparison of six numbers with six.
struct alignas(64) Member {
    std::array<Two, 3> ends;  ///< low x y z, then −high x y z, m
    Cell first;               ///< lowest cell numbers; the fourth is the triangle's number

    static Member of(const Primitive& p) {
        return {{Two{p.low[0], p.low[1]}, Two{p.low[2], -p.high[0]}, Two{-p.high[1], -p.high[2]}},
                Cell{p.range.low[0], p.range.low[1], p.range.low[2], p.triangle}};
    }
    [[nodiscard]] Index triangle() const { return first[3]; }
};
/// A Member as others are held against it in one cell.
struct Question {
    std::array<Two, 3> ends;  ///< high x y z, then −low x y z, m
    Cell first;
    Cell cell;

    Question(const Member& p, Cell where)
        : ends{Two{-p.ends[1][1], -p.ends[2][0]}, Two{-p.ends[2][1], -p.ends[0][0]}, Two{-p.ends[0][1], -p.ends[1][0]}},
          first(p.first),
          cell(where) {}
    using Answer = std::int64_t __attribute__((vector_size(16)));
    [[nodiscard]] Answer overlap(const Member& q) const {
        return (q.ends[0] <= ends[0]) & (q.ends[1] <= ends[1]) & (q.ends[2] <= ends[2]);
    }
    /// Whether this is the one cell in which the two count: its numbers are the larger of both lowest numbers.
    [[nodiscard]] Answer counts(const Member& q) const {
        return reinterpret_cast<Answer>((cell_max(first, q.first) == cell) | Cell{0, 0, 0, -1});
    }
    static bool yes(Answer answer) { return (answer[0] & answer[1]) == -1; }
};

constexpr CellRange no_cells{Cell{1, 1, 1, 0}, Cell{0, 0, 0, 0}};
bool is_empty(const CellRange& range) { return range.low[0] > range.high[0]; }
/// The range that holds both.
CellRange hull(const CellRange& a, const CellRange& b) {
    if (is_empty(a)) return b;
    if (is_empty(b)) return a;
    return {cell_min(a.low, b.low), cell_max(a.high, b.high)};
}
CellRange common(const CellRange& a, const CellRange& b) {
    if (is_empty(a) || is_empty(b) || !a.overlaps(b)) return no_cells;
    return {cell_max(a.low, b.low), cell_min(a.high, b.high)};
}

class Ohc final : public Detector {
public:
    explicit Ohc(const Settings& settings) : settings_(settings) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        const auto bodies = static_cast<std::size_t>(topology.body_count());
        const std::size_t words = (bodies + 63) / 64;
        std::vector<std::uint64_t> collide(bodies * words, 0);
        std::vector<bool> tested(bodies, false);
        for (const auto& [a, b] : topology.body_pairs) {
            for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
                const auto number = static_cast<std::size_t>(to);
                collide[static_cast<std::size_t>(from) * words + number / 64] |= std::uint64_t{1} << (number % 64);
                tested[static_cast<std::size_t>(from)] = true;
            }
        }
        // Few triangles first: the last and largest body then needs no marking, it only looks where the others are.
        // Under a limit instruments come first, so that what is cut off concerns them least.
        order_.clear();
        for (std::size_t body = 0; body < bodies; ++body) {
            if (tested[body] && topology.bodies[body].triangles.count > 0) order_.push_back(static_cast<Index>(body));
        }
        const auto rank = [this, &topology](Index body) {
            const BodyRange& range = topology.bodies[static_cast<std::size_t>(body)];
            return std::pair(settings_.limited() && range.kind != BodyKind::instrument, range.triangles.count);
        };
        std::stable_sort(order_.begin(), order_.end(), [&rank](Index a, Index b) { return rank(a) < rank(b); });
        make_groups(collide, words);
        map_.prepare(std::move(collide), words, settings_.hash, settings_.hash_bits);
        cells_.prepare(topology, settings_.margin);
        occupancy_.prepare(topology.vertex_count);
        last_pairs_.clear();
        // Room for a crowded tick; more than this grows as it comes.
        const auto room = static_cast<std::size_t>(std::min<Index>(16384, topology.triangle_count()));
        for (std::vector<Index>* list : {&found_, &huge_}) list->reserve(room);
        primitives_.reserve(room);
        members_.reserve(room);
        for (std::vector<TrianglePair>* list : {&candidates_, &repeated_, &sorted_}) list->reserve(room);
        map_.reserve(room);
        cell_edge_ = 0.0;
        choose_cell(frame);
        known_ = false;
        follows_ = settings_.incremental && !settings_.swept && !settings_.limited();
        if (follows_) list_triangles_of_vertices();
    }

    void update(const Frame& frame) override {
        work_ = {};
        if (follows_) {
            follow(frame);
            work_of_update_ = work_;
            return;
        }
        truncated_ = false;
        huge_.clear();
        primitives_.clear();
        entries_ = 0;
        cells_.set_way(false);
        answerable_ = read_boxes(frame);
        const std::int64_t to_read = topology_->vertex_count * std::int64_t{cells_.way() ? 2 : 1};
        if (answerable_ && groups_.size() > 1 && spend(work_.vertices_read, to_read)) {
            if (cell_edge_ == 0.0) choose_cell(frame);
            const CellRange meeting = place_groups();
            if (!is_empty(meeting)) {
                find_near(frame, meeting);
                find_shared(frame);
            }
        }
        work_of_update_ = work_;
        truncated_in_update_ = truncated_;
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!answerable_ && !check_frame(*topology_, frame, contacts)) return;
        work_ = work_of_update_;
        truncated_ = truncated_in_update_;
        if (follows_) {
            detect_changed(frame, contacts);
        } else if (settings_.limited()) {
            detect_limited(frame, contacts);
        } else {
            candidates_.clear();
            repeated_.clear();
            hash_shared(frame);
            gather_candidates([] { return true; });
            test_huge(frame);
            std::sort(repeated_.begin(), repeated_.end());
            repeated_.erase(std::unique(repeated_.begin(), repeated_.end()), repeated_.end());
            candidates_.insert(candidates_.end(), repeated_.begin(), repeated_.end());
            work_.triangle_tests += static_cast<std::int64_t>(candidates_.size());
            test_pairs(settings_.test, *topology_, frame, candidates_, contacts.pairs);
            if (cells_.way()) {
                work_.triangle_tests += static_cast<std::int64_t>(candidates_.size());
                test_swept(*topology_, frame, candidates_, contacts.swept);
            }
        }
        sort_pairs(contacts.pairs, sorted_);
        sort_swept(contacts.swept);
        contacts.work = work_;
        contacts.truncated = truncated_;
    }

private:
    /// Bodies with equal masks become a group: neither is in its own mask, so they cannot hit each other.
    void make_groups(const std::vector<std::uint64_t>& collide, std::size_t words) {
        const auto mask = [&](Index body) { return std::span(collide).subspan(at(body) * words, words); };
        const auto same = [&](Index a, Index b) { return std::ranges::equal(mask(a), mask(b)); };
        // Each body moves up to the first one of its group.
        groups_.clear();
        for (std::size_t begin = 0; begin < order_.size();) {
            const Index first = order_[begin];
            const auto end = std::stable_partition(order_.begin() + static_cast<std::ptrdiff_t>(begin), order_.end(),
                                                   [&](Index body) { return same(first, body); });
            const auto past = static_cast<std::size_t>(end - order_.begin());
            groups_.push_back({.first_body = begin, .end_body = past});
            begin = past;
        }
        boxes_.resize(topology_->bodies.size());
    }
    /// h: 1.5 × the mean edge of the moving body with the shortest edges (METHODS §12), but not below
    /// the mean edge of all triangles: a coarse body beside a fine one would spread over too many cells.
    void choose_cell(const Frame& frame) {
        if (!is_answerable(*topology_, frame)) return;
        Vector3 corner = Vector3::Zero();
        if (frame.position.cols() > 0) corner = frame.position.rowwise().minCoeff();
        double edge = settings_.cell;
        if (std::isnan(edge)) {
            double shortest = std::numeric_limits<double>::infinity();
            double shortest_moving = shortest;
            double sum = 0.0;
            double count = 0.0;
            for (const Index body : order_) {
                const BodyRange& range = topology_->bodies[static_cast<std::size_t>(body)];
                const double length = edge_length(frame, range.triangles);
                sum += length;
                count += 3.0 * range.triangles.count;
                const double mean = length / (3.0 * range.triangles.count);
                if (!(mean > 0.0)) continue;
                shortest = std::min(shortest, mean);
                if (range.kind != BodyKind::rigid) shortest_moving = std::min(shortest_moving, mean);
            }
            if (std::isfinite(shortest_moving)) shortest = shortest_moving;
            edge = std::max(1.5 * shortest, sum / count);
            if (!(edge > 0.0) || !std::isfinite(edge)) {
                cells_.lattice().set(1.0, corner);  // all points coincide; asked again at the next tick
                return;
            }
        }
        cell_edge_ = edge;
        cells_.lattice().set(edge, corner);
    }
    [[nodiscard]] double edge_length(const Frame& frame, Range triangles) const {
        double sum = 0.0;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            const auto v = topology_->triangles.col(t);
            for (int k = 0; k < 3; ++k) sum += (frame.position.col(v((k + 1) % 3)) - frame.position.col(v(k))).norm();
        }
        return sum;
    }

    /// Adds `amount` to a work counter; false, and the answer is marked as cut, when that would exceed the budget.
    bool spend(std::int64_t& counter, std::int64_t amount) {
        if (amount > settings_.work_budget - work_.work()) {
            truncated_ = true;
            return false;
        }
        counter += amount;
        return true;
    }

    // ---- lattice ----

    /// Boxes of all bodies, m. False when a number is not finite or the frame does not fit the topology.
    bool read_boxes(const Frame& frame) {
        if (frame.position.cols() != topology_->vertex_count) return false;
        cells_.set_way(settings_.swept && has_way(*topology_, frame));
        bool finite = true;
        for (std::size_t body = 0; body < topology_->bodies.size(); ++body) {
            const Range vertices = topology_->bodies[body].vertices;
            boxes_[body] = Extent{};
            if (vertices.count == 0) continue;
            const std::size_t first = 3 * at(vertices.first);
            finite &= kernels_.box_of_run(frame.position.data() + first, vertices.count, boxes_[body]);
            if (cells_.way()) {
                Extent before;
                finite &= kernels_.box_of_run(frame.previous.data() + first, vertices.count, before);
                boxes_[body].add(before);
            }
        }
        return finite;
    }
    /// Cell ranges of the groups; returns the cells in which two of them can meet, judged by their boxes.
    CellRange place_groups() {
        if (Lattice::at_limit(place_all())) {
            // Something is further than 2^30 cells from the corner chosen before: choose one where the bodies are now.
            Extent all;
            for (const Extent& box : boxes_) all.add(box);
            cells_.lattice().set(cells_.lattice().edge(), Vector3(all.low[0], all.low[1], all.low[2]));
            place_all();
        }
        CellRange merged = no_cells;
        CellRange meeting = no_cells;
        for (const Group& group : groups_) {
            meeting = hull(meeting, common(merged, group.range));
            merged = hull(merged, group.range);
        }
        return meeting;
    }
    CellRange place_all() {
        CellRange all = no_cells;
        for (Group& group : groups_) {
            group.range = no_cells;
            for (std::size_t k = group.first_body; k < group.end_body; ++k) {
                const Extent& box = boxes_[at(order_[k])];
                Vector3 low(box.low[0], box.low[1], box.low[2]);
                Vector3 high(box.high[0], box.high[1], box.high[2]);
                low.array() -= settings_.margin;
                high.array() += settings_.margin;
                group.range = hull(group.range, {cells_.lattice().cell(low), cells_.lattice().cell(high)});
            }
            all = hull(all, group.range);
        }
        return all;
    }

    // ---- occupancy ----

    /// Fills primitives_ with the triangles near cells that two groups may share.
    void find_near(const Frame& frame, const CellRange& meeting) {
        occupancy_.start(cells_.lattice(), meeting);
        for (std::size_t g = 0; g + 1 < groups_.size(); ++g) put_in_field(frame, groups_[g]);
        if (cells_.plain()) occupancy_.look_for_any();
        Group& last = groups_.back();
        last.first = primitives_.size();
        collect(frame, last, [this](const CellRange& range) { return occupancy_.share(range); });
        last.end = primitives_.size();
        if (last.first == last.end && groups_.size() == 2) return;
        if (cells_.plain()) occupancy_.look_for_shared();
        for (std::size_t g = 0; g + 1 < groups_.size(); ++g) {
            groups_[g].first = groups_[g].end = primitives_.size();
            if (!occupancy_.any_shared(groups_[g].range)) continue;
            collect(frame, groups_[g], [this](const CellRange& range) { return occupancy_.any_shared(range); });
            groups_[g].end = primitives_.size();
        }
    }
    /// All vertices of the group, and triangles that reach further than one cell from them.
    void put_in_field(const Frame& frame, const Group& group) {
        found_.clear();
        for_each_body(group, [&](const BodyRange& body) {
            if (!spend(work_.cells_visited, body.triangles.count)) return;
            if (!cells_.plain()) {
                add_all(body.triangles);
                return;
            }
            occupancy_.encode(frame, body.vertices);
            occupancy_.add_vertices(body.vertices);
            occupancy_.collect_wide(topology_->triangles.data(), body.triangles, found_);
        });
        for (const Index t : found_) {
            const bool placed =
                cells_.for_each_range(frame, cells_.primitive(frame, t), [this](const CellRange& range) {
                    if (afford(range)) work_.cells_visited += occupancy_.add(range);
                });
            if (!placed) huge_.push_back(t);
        }
        occupancy_.merge(group.range, cells_.plain());
    }
    /// The group's triangles that cannot be ruled out by a look at their vertices and of which `is_shared` tells that
    /// one of their cells is shared.
    template <typename IsShared>
    void collect(const Frame& frame, const Group& group, const IsShared& is_shared) {
        found_.clear();
        const bool last = &group == &groups_.back();
        for_each_body(group, [&](const BodyRange& body) {
            if (!spend(work_.cells_visited, body.triangles.count)) return;
            if (!cells_.plain()) {
                add_all(body.triangles);
                return;
            }
            if (last) occupancy_.encode(frame, body.vertices);
            occupancy_.mark(body.vertices);
            occupancy_.collect(topology_->triangles.data(), body.triangles, found_);
        });
        // First all boxes, then the question that nobody can predict the answer of: so the reads do not wait for it.
        std::size_t kept = primitives_.size();
        for (const Index t : found_) primitives_.push_back(cells_.primitive(frame, t));
        for (std::size_t k = kept; k < primitives_.size(); ++k) {
            const Primitive& primitive = primitives_[k];
            bool shared = false;
            const bool placed = cells_.for_each_range(frame, primitive, [&](const CellRange& range) {
                if (!afford(range)) return;
                ++work_.cells_visited;
                shared = is_shared(range) || shared;
            });
            if (!placed && last) huge_.push_back(primitive.triangle);
            if (shared) primitives_[kept++] = primitive;
        }
        primitives_.resize(kept);
    }
    template <typename Use>
    void for_each_body(const Group& group, const Use& use) const {
        for (std::size_t k = group.first_body; k < group.end_body; ++k) use(topology_->bodies[at(order_[k])]);
    }
    void add_all(Range triangles) {
        for (Index t = triangles.first; t < triangles.end(); ++t) found_.push_back(t);
    }
    /// Under a budget: whether one more range can be looked at.
    bool afford(const CellRange& range) {
        if (settings_.work_budget == std::numeric_limits<std::int64_t>::max()) return true;
        if (range.cell_count() <= static_cast<double>(settings_.work_budget - work_.work())) return !truncated_;
        truncated_ = true;
        return false;
    }

    /// The same question again for the triangles left, with the cells that they really cover.
    void find_shared(const Frame& frame) {
        const CellRange range = occupancy_.shared_range();
        if (is_empty(range)) {
            primitives_.clear();
            return;
        }
        shared_.start(cells_.lattice(), range);
        const auto for_each_range = [&](const Group& group, const auto& use) {
            for (std::size_t k = group.first; k < group.end; ++k) cells_.for_each_range(frame, primitives_[k], use);
        };
        for (std::size_t g = 0; g + 1 < groups_.size(); ++g) {
            for_each_range(groups_[g], [this](const CellRange& part) {
                if (afford(part)) work_.cells_visited += shared_.add(part);
            });
            shared_.merge(groups_[g].range, false);
        }
        for_each_range(groups_.back(), [this](const CellRange& part) {
            if (!afford(part)) return;
            ++work_.cells_visited;
            shared_.share(part);
        });
        std::size_t left = 0;
        for (const Primitive& primitive : primitives_) {
            std::size_t cells = 0;
            cells_.for_each_range(frame, primitive, [&](const CellRange& part) {
                shared_.for_each_shared(part, [&cells](Cell) { ++cells; });
            });
            if (cells == 0) continue;
            entries_ += cells;
            primitives_[left++] = primitive;
        }
        primitives_.resize(left);
    }

    // ---- cell, object and primitive maps ----

    void hash_shared(const Frame& frame) {
        map_.start(entries_);
        members_.clear();
        any_cut_ = false;
        for (std::size_t k = 0; k < primitives_.size(); ++k) {
            const Primitive& primitive = primitives_[k];
            members_.push_back(Member::of(primitive));
            any_cut_ = any_cut_ || primitive.cut;
            cells_.for_each_range(frame, primitive, [&](const CellRange& range) {
                shared_.for_each_shared(range, [&](Cell cell) {
                    if (spend(work_.cells_visited, 1)) map_.add(cell, primitive.body, static_cast<Index>(k));
                });
            });
        }
        map_.cascade();
    }

    /// Fills candidates_ (each pair once) and repeated_ (pairs of cut triangles). `after_meeting` is asked after the
    /// triangles of two bodies in one cell; false ends the search.
    template <typename AfterMeeting>
    void gather_candidates(const AfterMeeting& after_meeting) {
        map_.for_each_meeting(
            [&](const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second) {
                if (!spend(work_.box_tests, static_cast<std::int64_t>(first.size() * second.size()))) return false;
                for (const Index i : first) {
                    const Question p(members_[at(i)], Cell{cell[0], cell[1], cell[2], 0});
                    if (any_cut_) {
                        meet_cut(p, i, second);
                    } else {
                        meet(p, members_[at(i)].triangle(), second);
                    }
                }
                return after_meeting();
            });
    }

    /// Without branches: which boxes overlap, and in which cell a pair counts, is unpredictable.
    void meet(const Question& p, Index triangle, std::span<const Index> second) {
        std::size_t count = candidates_.size();
        candidates_.resize(count + second.size());
        for (const Index j : second) {
            const Member& q = members_[at(j)];
            candidates_[count] = {triangle, q.triangle()};
            count += Question::yes(p.overlap(q) & p.counts(q)) ? 1 : 0;
        }
        candidates_.resize(count);
    }
    /// As above where some triangles are in pieces: such a pair comes once per cell.
    void meet_cut(const Question& p, Index i, std::span<const Index> second) {
        for (const Index j : second) {
            const Member& q = members_[at(j)];
            if (!Question::yes(p.overlap(q))) continue;
            if (primitives_[at(i)].cut || primitives_[at(j)].cut) {
                repeated_.push_back({members_[at(i)].triangle(), q.triangle()});
            } else if (Question::yes(p.counts(q))) {
                candidates_.push_back({members_[at(i)].triangle(), q.triangle()});
            }
        }
    }

    /// Triangles too large for the lattice against every triangle of every body they may hit.
    void test_huge(const Frame& frame) {
        for (const Index t : huge_) {
            const Primitive p = cells_.primitive(frame, t);
            for (const Index body : order_) {
                if (!map_.may_hit(p.body, body)) continue;
                const Range triangles = topology_->bodies[at(body)].triangles;
                if (!spend(work_.box_tests, triangles.count)) return;
                for (Index other = triangles.first; other < triangles.end(); ++other) {
                    if (boxes_overlap(p, cells_.primitive(frame, other))) {
                        repeated_.push_back({std::min(t, other), std::max(t, other)});
                    }
                }
            }
        }
    }

    // ---- incremental ----

    /// Which triangles move when a vertex moves.
    void list_triangles_of_vertices() {
        const auto vertices = static_cast<std::size_t>(topology_->vertex_count);
        first_triangle_.assign(vertices + 1, 0);
        const Index* const corners = topology_->triangles.data();
        for (Index i = 0; i < 3 * topology_->triangle_count(); ++i) ++first_triangle_[at(corners[i]) + 1];
        std::partial_sum(first_triangle_.begin(), first_triangle_.end(), first_triangle_.begin());
        triangles_of_vertices_.resize(3 * static_cast<std::size_t>(topology_->triangle_count()));
        std::vector<Index> next(first_triangle_.begin(), first_triangle_.end() - 1);
        for (Index t = 0; t < topology_->triangle_count(); ++t) {
            for (int k = 0; k < 3; ++k) triangles_of_vertices_[at(next[at(topology_->triangles(k, t))]++)] = t;
        }
        takes_part_.assign(topology_->bodies.size(), 0);
        for (const Index body : order_) takes_part_[at(body)] = 1;
        const auto triangles = static_cast<std::size_t>(topology_->triangle_count());
        changed_at_.assign(triangles, 0);
        ranges_.assign(triangles, CellRange{});
        places_.assign(triangles, Place::cells);
        change_ = 0;
        changed_.clear();
        last_.resize(3, 0);
        answered_ = true;
    }

    /// Looks for vertices that moved, among the ranges that the frame tells or among all, and puts their triangles into
    /// other cells where need be. What the last detect found about the others stays true.
    void follow(const Frame& frame) {
        truncated_ = truncated_in_update_ = false;
        answerable_ = is_answerable(*topology_, frame);
        if (!answerable_) {
            known_ = false;  // ranges told by later frames start from a frame that was not followed
            return;
        }
        if (order_.size() < 2) return;
        if (answered_) {
            ++change_;
            changed_.clear();
            answered_ = false;
        }
        const bool followed_before = known_;
        if (cell_edge_ == 0.0) {
            choose_cell(frame);
            last_.resize(3, 0);
        }
        if (last_.cols() != frame.position.cols()) {
            stand_anew(frame);
            return;
        }
        known_ = true;
        const Range everything{0, topology_->vertex_count};
        const std::span<const Range> told = followed_before && frame.moved ? std::span<const Range>(*frame.moved)
                                                                           : std::span<const Range>(&everything, 1);
        for (const Range& range : told) {
            const Index first = std::clamp(range.first, 0, everything.count);
            const Index end = std::clamp(range.end(), first, everything.count);
            if (!follow_range(frame, {first, end - first})) {
                stand_anew(frame);
                return;
            }
        }
        rehash_changed(frame);
    }

    /// False when a vertex went beyond the lattice.
    bool follow_range(const Frame& frame, Range range) {
        work_.vertices_read += range.count;
        const double* const here = frame.position.data();
        double* const before = last_.data();
        for (Index v = range.first; v < range.end(); ++v) {
            const std::size_t i = 3 * at(v);
            if (here[i] == before[i] && here[i + 1] == before[i + 1] && here[i + 2] == before[i + 2]) continue;
            std::copy_n(here + i, 3, before + i);
            const Vector3 point(here[i], here[i + 1], here[i + 2]);
            const Vector3 margin = Vector3::Constant(settings_.margin);
            if (Lattice::at_limit({cells_.lattice().cell(point - margin), cells_.lattice().cell(point + margin)})) {
                return false;
            }
            for (Index k = first_triangle_[at(v)]; k < first_triangle_[at(v) + 1]; ++k) {
                const Index t = triangles_of_vertices_[at(k)];
                if (changed_at_[at(t)] == change_ || takes_part_[at(body_of(t))] == 0) continue;
                changed_at_[at(t)] = change_;
                changed_.push_back(t);
            }
        }
        return true;
    }

    /// All triangles into empty maps: at the first frame, and when the bodies left the lattice.
    void stand_anew(const Frame& frame) {
        known_ = true;
        last_ = frame.position;
        (void)read_boxes(frame);
        place_groups();
        work_.vertices_read += topology_->vertex_count;
        standing_.start(topology_->triangle_count(), settings_.hash, settings_.hash_bits);
        std::fill(places_.begin(), places_.end(), Place::nowhere);
        huge_.clear();
        changed_.clear();
        for (const Index body : order_) {
            const Range triangles = topology_->bodies[at(body)].triangles;
            for (Index t = triangles.first; t < triangles.end(); ++t) {
                changed_at_[at(t)] = change_;
                changed_.push_back(t);
            }
        }
        rehash_changed(frame);
    }

    void rehash_changed(const Frame& frame) {
        for (const Index t : changed_) {
            const Primitive primitive = cells_.primitive(frame, t);
            const CellRange& range = primitive.range;
            const bool plain = !primitive.cut;
            if (plain && places_[at(t)] == Place::cells && range == ranges_[at(t)]) continue;
            if (places_[at(t)] == Place::huge) huge_.erase(std::find(huge_.begin(), huge_.end(), t));
            if (places_[at(t)] != Place::huge) work_.cells_visited += standing_.remove(t);
            ranges_[at(t)] = range;
            places_[at(t)] = plain ? Place::cells : Place::pieces;
            const bool placed = cells_.for_each_range(frame, primitive, [&](const CellRange& part) {
                for (std::int32_t z = part.low[2]; z <= part.high[2]; ++z) {
                    for (std::int32_t y = part.low[1]; y <= part.high[1]; ++y) {
                        for (std::int32_t x = part.low[0]; x <= part.high[0]; ++x) {
                            ++work_.cells_visited;
                            standing_.insert(Cell{x, y, z, 0}, body_of(t), t);
                        }
                    }
                }
            });
            if (!placed) {
                places_[at(t)] = Place::huge;
                huge_.push_back(t);
            }
        }
    }

    /// Pairs of which neither triangle moved are as before; the others are looked for around the triangles that moved.
    void detect_changed(const Frame& frame, ContactSet& contacts) {
        candidates_.clear();
        repeated_.clear();
        const auto changed = [this](Index t) { return changed_at_[at(t)] == change_; };
        for (const TrianglePair& pair : last_pairs_) {
            if (!changed(pair.a) && !changed(pair.b)) contacts.pairs.push_back(pair);
        }
        for (const Index t : changed_) {
            if (places_[at(t)] == Place::huge) continue;
            const Index own = body_of(t);
            const Primitive p = cells_.primitive(frame, t);
            work_.cells_visited += standing_.for_each_neighbour(
                t, [&](const std::array<std::int32_t, 3>& cell, Index body, std::int32_t first) {
                    if (!map_.may_hit(own, body)) return;
                    standing_.for_each_triangle(first, [&](Index other) {
                        ++work_.box_tests;
                        if (changed(other) && body < own) return;  // found from there
                        const CellRange& range = ranges_[at(other)];
                        const bool cut = p.cut || places_[at(other)] == Place::pieces;
                        if (!cut && (cell[0] != std::max(p.range.low[0], range.low[0]) ||
                                     cell[1] != std::max(p.range.low[1], range.low[1]) ||
                                     cell[2] != std::max(p.range.low[2], range.low[2]))) {
                            return;
                        }
                        add_candidate(frame, p, other, cut ? repeated_ : candidates_);
                    });
                });
        }
        for (const Index t : huge_) {
            const Primitive p = cells_.primitive(frame, t);
            const auto look_at = [&](Index other) {
                if (!map_.may_hit(body_of(t), body_of(other))) return;
                ++work_.box_tests;
                add_candidate(frame, p, other, repeated_);
            };
            if (!changed(t)) {
                for (const Index other : changed_) look_at(other);
                continue;
            }
            for (const Index body : order_) {
                const Range triangles = topology_->bodies[at(body)].triangles;
                for (Index other = triangles.first; other < triangles.end(); ++other) look_at(other);
            }
        }
        std::sort(repeated_.begin(), repeated_.end());
        repeated_.erase(std::unique(repeated_.begin(), repeated_.end()), repeated_.end());
        candidates_.insert(candidates_.end(), repeated_.begin(), repeated_.end());
        work_.triangle_tests += static_cast<std::int64_t>(candidates_.size());
        test_pairs(settings_.test, *topology_, frame, candidates_, contacts.pairs);
        last_pairs_ = contacts.pairs;
        answered_ = true;
    }
    void add_candidate(const Frame& frame, const Primitive& p, Index other, std::vector<TrianglePair>& list) const {
        if (boxes_overlap(p, cells_.primitive(frame, other)))
            list.push_back({std::min(p.triangle, other), std::max(p.triangle, other)});
    }
    [[nodiscard]] Index body_of(Index triangle) const { return topology_->body_of_triangle[at(triangle)]; }

    // ---- limits ----

    /// The same answer under limits: the pairs of the last tick are tested first, then whatever the cascade brings,
    /// instruments first, until the pairs or the work run out.
    void detect_limited(const Frame& frame, ContactSet& contacts) {
        tested_.clear();
        candidates_ = last_pairs_;
        repeated_.clear();
        const auto flush = [&] {
            candidates_.insert(candidates_.end(), repeated_.begin(), repeated_.end());
            repeated_.clear();
            for (const TrianglePair& pair : candidates_) {
                const auto place = std::lower_bound(tested_.begin(), tested_.end(), pair);
                if (place != tested_.end() && *place == pair) continue;
                if (static_cast<std::int64_t>(contacts.pairs.size()) >= settings_.max_pairs) truncated_ = true;
                if (truncated_ || !spend(work_.triangle_tests, 1)) return false;
                tested_.insert(place, pair);
                test_pairs(settings_.test, *topology_, frame, {&pair, 1}, contacts.pairs);
                if (!cells_.way() || !either_moved(*topology_, frame, pair)) continue;
                if (static_cast<std::int64_t>(contacts.swept.size()) >= settings_.max_pairs) truncated_ = true;
                if (truncated_ || !spend(work_.triangle_tests, 1)) return false;
                test_swept(*topology_, frame, {&pair, 1}, contacts.swept);
            }
            candidates_.clear();
            return true;
        };
        const bool cut_before = std::exchange(truncated_, false);
        if (flush() && !cut_before) {
            hash_shared(frame);
            if (!truncated_) gather_candidates(flush);
            if (!truncated_) test_huge(frame);
            if (!truncated_) flush();
        }
        truncated_ = truncated_ || cut_before;
        last_pairs_ = contacts.pairs;
        std::sort(last_pairs_.begin(), last_pairs_.end());
    }

    static std::size_t at(Index number) { return static_cast<std::size_t>(number); }

    Settings settings_;
    const Topology* topology_ = nullptr;
    const ClusterKernels& kernels_ = cluster_kernels().front();
    std::vector<Index> order_;  ///< bodies that take part
    std::vector<Group> groups_;
    double cell_edge_ = 0.0;  ///< m; 0: not chosen yet
    TriangleCells cells_;
    Occupancy occupancy_;  ///< where groups may meet, judged by vertices
    Occupancy shared_;     ///< where they do, judged by triangles
    CellMap map_;
    bool answerable_ = false;
    bool truncated_ = false;
    WorkCounters work_;
    WorkCounters work_of_update_;
    bool truncated_in_update_ = false;

    // Buffers of one tick.
    std::vector<Extent> boxes_;  ///< per body, m
    std::vector<Index> found_;   ///< triangles that a look at their vertices did not rule out
    std::vector<Index> huge_;    ///< triangles tested against everything
    std::size_t entries_ = 0;    ///< of the cell map, at most
    std::vector<Primitive> primitives_;
    std::vector<Member> members_;  ///< same numbers
    bool any_cut_ = false;
    std::vector<TrianglePair> sorted_;  ///< scratch
    std::vector<TrianglePair> candidates_;
    std::vector<TrianglePair> repeated_;
    std::vector<TrianglePair> tested_;      ///< under limits: sorted, what was tested this tick
    std::vector<TrianglePair> last_pairs_;  ///< under limits and when incremental: what the tick before reported

    // What is kept from tick to tick; all empty unless incremental.
    enum class Place : std::uint8_t { nowhere, cells, pieces, huge };
    bool follows_ = false;
    bool known_ = false;    ///< the frame before was followed
    bool answered_ = true;  ///< detect has seen the changes; until then they add up
    StandingMap standing_;
    Matrix3X last_;                             ///< 3×N, m: the positions that the maps stand for
    std::vector<Index> first_triangle_;         ///< N + 1; where the triangles of a vertex start
    std::vector<Index> triangles_of_vertices_;  ///< 3 T
    std::vector<std::uint8_t> takes_part_;      ///< per body
    std::vector<std::uint32_t> changed_at_;     ///< per triangle: the change in which it last moved
    std::vector<CellRange> ranges_;             ///< per triangle
    std::vector<Place> places_;                 ///< per triangle
    std::vector<Index> changed_;
    std::uint32_t change_ = 0;
};

}  // namespace

DetectorEntry ohc_detector() {
    using Type = Parameter::Type;
    return {
        .name = "ohc",
        .configuration = "double precision cells and boxes; exact triangle test; one thread",
        .own = true,
        .claims_exact = true,
        .parameters =
            {{.name = "cell",
              .unit = "m",
              .default_value = "auto",
              .minimum = 1e-12,
              .meaning =
                  "edge of a cell; auto = 1.5 x the mean edge of the moving body with the shortest edges, at least the "
                  "scene's mean edge",
              .words = {"auto"}},
             {.name = "hash",
              .type = Type::choice,
              .default_value = "fibonacci",
              .choices = {"fibonacci", "teschner"},
              .meaning = "hash of a cell's numbers; changes the time, never the answer"},
             {.name = "hash_bits",
              .type = Type::integer,
              .unit = "1",
              .default_value = "12",
              .minimum = 1,
              .maximum = 24,
              .meaning = "the cell map starts with 2^hash_bits slots and doubles when half full"},
             {.name = "margin",
              .unit = "m",
              .default_value = "0",
              .minimum = 0.0,
              .meaning = "added around every triangle while looking for candidates; never part of the answer"},
             test_parameter(),
             {.name = "incremental",
              .type = Type::choice,
              .default_value = "off",
              .choices = {"off", "on"},
              .meaning = "keep the maps from tick to tick and look only at what moved: for scenes in which most "
                         "vertices rest; "
                         "without effect under limits or with swept=on"},
             swept_parameter(),
             max_pairs_parameter(),
             work_budget_parameter()},
        .make = [](const ParameterValues& values) {
            Settings settings;
            settings.cell = values.number("cell");
            settings.hash = values.is("hash", "teschner") ? CellHash::teschner : CellHash::fibonacci;
            settings.hash_bits = static_cast<int>(values.integer("hash_bits"));
            settings.margin = values.number("margin");
            settings.incremental = values.is("incremental", "on");
            settings.swept = values.is("swept", "on");
            settings.test = triangle_test_from(values.text("test"));
            if (!values.is("max_pairs", "none")) settings.max_pairs = values.integer("max_pairs");
            if (!values.is("work_budget", "none")) settings.work_budget = values.integer("work_budget");
            return std::make_unique<Ohc>(settings);
        }};
}

}  // namespace trocar
