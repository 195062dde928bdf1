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
//
// Nothing is remembered from tick to tick, but with incremental=on: then bodies that rest, or of which less than half
// moves, stay out of the cascade and their triangles stay hashed (kept_triangles.hpp), and under limits: then the pairs
// of the tick before are tested first, what concerns an instrument next, all else last.
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
#include "detect/kept_triangles.hpp"
#include "detect/lattice.hpp"
#include "detect/narrow_phase.hpp"
#include "detect/occupancy.hpp"
#include "detect/pair_sort.hpp"
#include "detect/shared_parameters.hpp"
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
        last_.resize(3, 0);
        answered_ = true;
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
        at_rest_ = settings_.incremental && settings_.limited() && !settings_.swept && is_at_rest(frame);
        if (at_rest_) {
            work_of_update_ = work_;
            return;
        }
        huge_.clear();
        primitives_.clear();
        entries_ = 0;
        cells_.set_way(false);
        answerable_ = read_boxes(frame);
        const std::int64_t to_read = topology_->vertex_count * std::int64_t{cells_.way() ? 2 : 1};
        if (answerable_ && active_.size() > 1 && spend(work_.vertices_read, to_read)) {
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
        if (at_rest_) {
            contacts.pairs = last_pairs_;
            truncated_ = last_truncated_;
        } else if (follows_) {
            detect_changed(frame, contacts);
        } else if (settings_.limited()) {
            detect_limited(frame, contacts);
        } else {
            candidates_.clear();
            repeated_.clear();
            hash_shared(frame);
            gather_candidates(any_bodies, [] { return true; });
            test_huge(frame, any_bodies);
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
        takes_part_.assign(topology_->bodies.size(), 0);
        for (const Index body : order_) takes_part_[at(body)] = 1;
        active_ = groups_;
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
        for (const Group& group : active_) {
            meeting = hull(meeting, common(merged, group.range));
            merged = hull(merged, group.range);
        }
        return meeting;
    }
    CellRange place_all() {
        CellRange all = no_cells;
        for (Group& group : active_) {
            group.range = no_cells;
            for (std::size_t k = group.first_body; k < group.end_body; ++k) {
                if (is_kept(order_[k])) continue;
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

    /// Fills primitives_ with the triangles near cells that two groups may share, and huge_.
    void find_near(const Frame& frame, const CellRange& meeting) {
        find_primitives(frame, meeting);
        std::sort(huge_.begin(), huge_.end());
        huge_.erase(std::unique(huge_.begin(), huge_.end()), huge_.end());
    }
    void find_primitives(const Frame& frame, const CellRange& meeting) {
        occupancy_.start(cells_.lattice(), meeting);
        for (std::size_t g = 0; g + 1 < active_.size(); ++g) put_in_field(frame, active_[g]);
        if (cells_.plain()) occupancy_.look_for_any();
        Group& last = active_.back();
        last.first = primitives_.size();
        collect(frame, last, [this](const CellRange& range) { return occupancy_.share(range); });
        last.end = primitives_.size();
        if (last.first == last.end && active_.size() == 2) return;
        if (cells_.plain()) occupancy_.look_for_shared();
        for (std::size_t g = 0; g + 1 < active_.size(); ++g) {
            Group& group = active_[g];
            group.first = group.end = primitives_.size();
            if (!occupancy_.any_shared(group.range)) continue;
            collect(frame, group, [this](const CellRange& range) { return occupancy_.any_shared(range); });
            group.end = primitives_.size();
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
        const bool last = &group == &active_.back();
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
            if (!placed) huge_.push_back(primitive.triangle);  // a coarse cell may hold all of a huge one
            if (shared) primitives_[kept++] = primitive;
        }
        primitives_.resize(kept);
    }
    template <typename Use>
    void for_each_body(const Group& group, const Use& use) const {
        for (std::size_t k = group.first_body; k < group.end_body; ++k) {
            if (!is_kept(order_[k])) use(topology_->bodies[at(order_[k])]);
        }
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
        for (std::size_t g = 0; g + 1 < active_.size(); ++g) {
            for_each_range(active_[g], [this](const CellRange& part) {
                if (afford(part)) work_.cells_visited += shared_.add(part);
            });
            shared_.merge(active_[g].range, false);
        }
        for_each_range(active_.back(), [this](const CellRange& part) {
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

    static bool any_bodies(Index /*a*/, Index /*b*/) { return true; }

    /// Fills candidates_ (each pair once) and repeated_ (pairs of cut triangles) from the bodies that are `wanted`.
    /// `after_meeting` is asked after the triangles of two bodies in one cell; false ends the search.
    template <typename Wanted, typename AfterMeeting>
    void gather_candidates(const Wanted& wanted, const AfterMeeting& after_meeting) {
        map_.for_each_meeting(
            [&](const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second) {
                if (!wanted(primitives_[at(first.front())].body, primitives_[at(second.front())].body)) return true;
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
    template <typename Wanted>
    void test_huge(const Frame& frame, const Wanted& wanted) {
        for (const Index t : huge_) {
            const Primitive p = cells_.primitive(frame, t);
            for (const Index body : order_) {
                if (!map_.may_hit(p.body, body) || is_kept(body) || !wanted(p.body, body)) continue;
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
    //
    // A body of which most moves goes through the cascade at every tick. A body that rests, or of which less than half
    // moves, is kept: its triangles stay hashed, those that moved are looked around, and what moves elsewhere asks the
    // maps that are there. Pairs of two triangles that did not move are taken over from the tick before.

    static constexpr int patience = 8;  ///< ticks of rest, or nearly, after which a body is kept

    struct Following {
        bool kept = false;
        bool moved = false;      ///< not kept: since the last answer
        int calm = 0;            ///< ticks since it last moved as a whole
        std::int64_t asked = 0;  ///< vertices that may have moved
    };
    [[nodiscard]] bool is_kept(Index body) const { return follows_ && following_[at(body)].kept; }

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
        following_.assign(topology_->bodies.size(), Following{});
        changed_at_.assign(static_cast<std::size_t>(topology_->triangle_count()), 0);
        change_ = 0;
        changed_.clear();
        last_.resize(3, 0);
        answered_ = true;
        moving_ = false;
    }

    /// Finds out what moved, among the ranges that the frame tells or among all, and puts kept triangles into other
    /// cells where need be.
    void follow(const Frame& frame) {
        truncated_ = truncated_in_update_ = false;
        // Ranges told by later frames start from a frame that was followed.
        const bool told = std::exchange(known_, false) && frame.moved.has_value();
        answerable_ = frame.position.cols() == topology_->vertex_count;
        if (!answerable_) return;
        if (answered_) {
            ++change_;
            changed_.clear();
            moving_ = false;
            answered_ = false;
        }
        redo_ = false;
        if (last_.cols() == 0 || cell_edge_ == 0.0) {
            answerable_ = known_ = is_answerable(*topology_, frame);
            if (answerable_) keep_all(frame);
            return;
        }
        answerable_ = known_ = look_at_bodies(frame, told) && look_at_vertices(frame, told);
        if (!answerable_) return;
        active_.clear();
        for (const Group& group : groups_) {
            for (std::size_t k = group.first_body; k < group.end_body; ++k) {
                if (is_kept(order_[k])) continue;
                active_.push_back(group);
                break;
            }
        }
        if (!rehash_changed(frame)) {
            keep_all(frame);
            return;
        }
        if (!active_.empty() && Lattice::at_limit(place_all())) {
            keep_all(frame);
            return;
        }
        redo_ = !active_.empty() && (moving_ || changed_near_moving());
        primitives_.clear();
        huge_.clear();
        entries_ = 0;
        if (!redo_) return;
        const CellRange meeting = place_groups();
        if (active_.size() < 2 || is_empty(meeting)) return;
        find_near(frame, meeting);
        find_shared(frame);
    }

    /// Which bodies move as a whole, in part or not at all. False when a number is not finite.
    bool look_at_bodies(const Frame& frame, bool told) {
        for (std::size_t body = 0; body < following_.size(); ++body) {
            following_[body].asked = told ? 0 : topology_->bodies[body].vertices.count;
        }
        if (told) {
            for_each_told(frame, [this](Index body, Range part) { following_[at(body)].asked += part.count; });
        }
        leaving_.clear();
        bool finite = true;
        for (std::size_t body = 0; body < following_.size(); ++body) {
            Following& state = following_[body];
            const Range vertices = topology_->bodies[body].vertices;
            if (state.asked == 0 && (state.kept || told)) {
                if (!state.kept) ++state.calm;
            } else if (state.kept) {
                if (2 * state.asked > vertices.count && most_samples_moved(frame, vertices)) {
                    leaving_.push_back(static_cast<Index>(body));
                }
            } else {
                const std::int64_t moved = told ? state.asked : count_moved(frame, vertices);
                state.moved = state.moved || moved > 0;
                state.calm = 2 * moved > vertices.count ? 0 : state.calm + 1;
                work_.vertices_read += vertices.count;
                if (moved > 0) finite &= read_box(frame, body);
                moving_ = moving_ || (moved > 0 && takes_part(static_cast<Index>(body)));
            }
        }
        for (const Index body : leaving_) {
            finite &= read_box(frame, at(body));
            following_[at(body)] = {.kept = false, .moved = true};
            work_.vertices_read += topology_->bodies[at(body)].vertices.count;
            moving_ = true;
        }
        if (!leaving_.empty()) forget_leaving(frame);
        if (!finite) return false;
        for (const Index body : order_) {
            if (following_[at(body)].kept || following_[at(body)].calm < patience) continue;
            following_[at(body)] = {.kept = true};
            const BodyRange& range = topology_->bodies[at(body)];
            last_.middleCols(range.vertices.first, range.vertices.count) =
                frame.position.middleCols(range.vertices.first, range.vertices.count);
            for (Index t = range.triangles.first; t < range.triangles.end(); ++t) change(t);
        }
        return true;
    }
    [[nodiscard]] bool takes_part(Index body) const { return takes_part_[at(body)] != 0; }
    bool read_box(const Frame& frame, std::size_t body) {
        const Range vertices = topology_->bodies[body].vertices;
        return vertices.count == 0 ||
               kernels_.box_of_run(frame.position.data() + 3 * at(vertices.first), vertices.count, boxes_[body]);
    }
    template <typename Use>
    void for_each_told(const Frame& frame, const Use& use) const {
        for (const Range& range : *frame.moved) {
            for (std::size_t body = 0; body < topology_->bodies.size(); ++body) {
                const Range own = topology_->bodies[body].vertices;
                const Index first = std::max(range.first, own.first);
                const Index end = std::min(range.end(), own.end());
                if (first < end) use(static_cast<Index>(body), Range{first, end - first});
            }
        }
    }
    [[nodiscard]] bool vertex_moved(const Frame& frame, Index v) const {
        const double* const here = frame.position.data() + 3 * at(v);
        const double* const before = last_.data() + 3 * at(v);
        return !(here[0] == before[0] && here[1] == before[1] && here[2] == before[2]);
    }
    void remember(const Frame& frame, Index v) {
        std::copy_n(frame.position.data() + 3 * at(v), 3, last_.data() + 3 * at(v));
    }
    /// A look at some vertices, spread evenly, which is all that a moving body pays for the question.
    [[nodiscard]] bool most_samples_moved(const Frame& frame, Range vertices) const {
        const Index stride = std::max(1, vertices.count / 32);
        Index moved = 0;
        Index samples = 0;
        for (Index v = vertices.first; v < vertices.end(); v += stride, ++samples) {
            moved += vertex_moved(frame, v) ? 1 : 0;
        }
        return 2 * moved > samples;
    }
    /// How many vertices moved since they were last remembered; all of them when most samples moved.
    std::int64_t count_moved(const Frame& frame, Range vertices) {
        if (most_samples_moved(frame, vertices)) {
            const Index stride = std::max(1, vertices.count / 32);
            for (Index v = vertices.first; v < vertices.end(); v += stride) remember(frame, v);
            return vertices.count;
        }
        std::int64_t moved = 0;
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            if (!vertex_moved(frame, v)) continue;
            ++moved;
            remember(frame, v);
        }
        return moved;
    }
    /// The maps without the bodies that move as a whole from this tick on.
    void forget_leaving(const Frame& frame) {
        std::int64_t leaving = 0;
        std::int64_t staying = 0;
        for (const Index body : leaving_) leaving += topology_->bodies[at(body)].triangles.count;
        for (const Index body : order_) {
            if (is_kept(body)) staying += topology_->bodies[at(body)].triangles.count;
        }
        if (leaving <= staying) {
            for (const Index body : leaving_) {
                const Range triangles = topology_->bodies[at(body)].triangles;
                for (Index t = triangles.first; t < triangles.end(); ++t) work_.cells_visited += kept_.take(t);
            }
            return;
        }
        kept_.start(topology_->triangle_count(), settings_.hash, settings_.hash_bits);
        for (const Index body : order_) {
            if (!is_kept(body)) continue;
            const Range triangles = topology_->bodies[at(body)].triangles;
            for (Index t = triangles.first; t < triangles.end(); ++t) {
                work_.cells_visited += kept_.put(frame, cells_, cells_.primitive(frame, t));
            }
        }
    }

    /// Which triangles of kept bodies moved. False when a number is not finite.
    bool look_at_vertices(const Frame& frame, bool told) {
        if (told) {
            bool finite = true;
            for_each_told(frame, [&](Index body, Range part) {
                if (is_kept(body) && finite) finite = look_at_range(frame, part);
            });
            return finite;
        }
        for (const Index body : order_) {
            if (is_kept(body) && !look_at_range(frame, topology_->bodies[at(body)].vertices)) return false;
        }
        return true;
    }
    bool look_at_range(const Frame& frame, Range range) {
        work_.vertices_read += range.count;
        for (Index v = range.first; v < range.end(); ++v) {
            if (!vertex_moved(frame, v)) continue;
            if (!frame.position.col(v).allFinite()) return false;
            remember(frame, v);
            for (Index k = first_triangle_[at(v)]; k < first_triangle_[at(v) + 1]; ++k) {
                change(triangles_of_vertices_[at(k)]);
            }
        }
        return true;
    }
    void change(Index triangle) {
        if (std::exchange(changed_at_[at(triangle)], change_) != change_) changed_.push_back(triangle);
    }

    /// All triangles into empty maps: at the first frame, and when a kept one left the lattice.
    void keep_all(const Frame& frame) {
        if (cell_edge_ == 0.0) choose_cell(frame);
        (void)read_boxes(frame);
        for (Following& state : following_) state = {};
        active_ = groups_;
        place_groups();
        active_.clear();
        for (const Index body : order_) following_[at(body)].kept = true;
        last_ = frame.position;
        moving_ = redo_ = false;
        work_.vertices_read += topology_->vertex_count;
        kept_.start(topology_->triangle_count(), settings_.hash, settings_.hash_bits);
        primitives_.clear();
        huge_.clear();
        entries_ = 0;
        for (const Index body : order_) {
            const Range triangles = topology_->bodies[at(body)].triangles;
            for (Index t = triangles.first; t < triangles.end(); ++t) change(t);
        }
        (void)rehash_changed(frame);
    }
    /// False when a triangle is beyond the lattice, whose corner may have been chosen elsewhere.
    bool rehash_changed(const Frame& frame) {
        bool inside = true;
        for (const Index t : changed_) {
            if (!is_kept(body_of(t))) continue;  // changed first and moved on with its whole body
            const Primitive p = cells_.primitive(frame, t);
            inside = inside && !Lattice::at_limit(p.range);
            work_.cells_visited += kept_.put(frame, cells_, p);
        }
        return inside;
    }
    /// Whether a kept triangle moved where a body is that goes through the cascade.
    [[nodiscard]] bool changed_near_moving() const {
        return std::any_of(changed_.begin(), changed_.end(), [this](Index t) {
            if (!is_kept(body_of(t))) return true;
            if (kept_.is_huge(t)) return true;
            return std::any_of(active_.begin(), active_.end(),
                               [&](const Group& group) { return group.range.overlaps(kept_.range(t)); });
        });
    }

    void detect_changed(const Frame& frame, ContactSet& contacts) {
        candidates_.clear();
        repeated_.clear();
        const auto stays = [this](Index t) {
            return changed_at_[at(t)] != change_ && !(redo_ && !is_kept(body_of(t)));
        };
        for (const TrianglePair& pair : last_pairs_) {
            if (stays(pair.a) && stays(pair.b)) contacts.pairs.push_back(pair);
        }
        if (redo_) {
            hash_shared(frame);
            gather_candidates(any_bodies, [] { return true; });
            test_huge(frame, any_bodies);
            ask_kept(frame);
        }
        look_around_changed(frame);
        look_around_huge(frame, stays);
        std::sort(repeated_.begin(), repeated_.end());
        repeated_.erase(std::unique(repeated_.begin(), repeated_.end()), repeated_.end());
        candidates_.insert(candidates_.end(), repeated_.begin(), repeated_.end());
        work_.triangle_tests += static_cast<std::int64_t>(candidates_.size());
        test_pairs(settings_.test, *topology_, frame, candidates_, contacts.pairs);
        last_pairs_ = contacts.pairs;
        answered_ = true;
    }
    /// Triangles of bodies that are not kept against those that are.
    void ask_kept(const Frame& frame) {
        if (std::none_of(order_.begin(), order_.end(), [this](Index body) { return is_kept(body); })) return;
        kept_.cover(cells_.lattice());
        for (const Group& group : active_) {
            if (!kept_.any_near(group.range) && kept_.huge().empty()) continue;
            for_each_body(group, [&](const BodyRange& body) {
                work_.cells_visited += body.triangles.count;
                for (Index t = body.triangles.first; t < body.triangles.end(); ++t) ask_kept(frame, t);
            });
        }
    }
    void ask_kept(const Frame& frame, Index triangle) {
        const Primitive p = cells_.primitive(frame, triangle);
        if (!kept_.any_near(p.range)) return;
        const bool placed = cells_.for_each_range(frame, p, [&](const CellRange& part) {
            work_.cells_visited +=
                kept_.for_each_in(part, [&](const std::array<std::int32_t, 3>& cell, Index body, std::int32_t first) {
                    if (map_.may_hit(p.body, body)) meet_kept(frame, p, cell, first);
                });
        });
        if (placed) return;
        for (const Index body : order_) {
            if (!map_.may_hit(p.body, body) || !is_kept(body)) continue;
            const Range others = topology_->bodies[at(body)].triangles;
            work_.box_tests += others.count;
            for (Index other = others.first; other < others.end(); ++other) {
                add_candidate(p, cells_.primitive(frame, other), repeated_);
            }
        }
    }
    /// Triangles of one body in one cell.
    void meet_kept(const Frame& frame, const Primitive& p, const std::array<std::int32_t, 3>& cell,
                   std::int32_t first) {
        kept_.for_each_triangle(first, [&](Index other) { meet_kept_one(frame, p, cell, other); });
    }
    void meet_kept_one(const Frame& frame, const Primitive& p, const std::array<std::int32_t, 3>& cell, Index other) {
        ++work_.box_tests;
        const CellRange& range = kept_.range(other);
        const bool cut = p.cut || kept_.is_cut(other);
        if (!cut &&
            (cell[0] != std::max(p.range.low[0], range.low[0]) || cell[1] != std::max(p.range.low[1], range.low[1]) ||
             cell[2] != std::max(p.range.low[2], range.low[2]))) {
            return;
        }
        add_candidate(p, cells_.primitive(frame, other), cut ? repeated_ : candidates_);
    }
    /// Kept triangles that moved against all kept ones.
    void look_around_changed(const Frame& frame) {
        // With one group there is nobody to meet.
        const std::size_t kept_groups =
            static_cast<std::size_t>(std::count_if(groups_.begin(), groups_.end(), [this](const Group& group) {
                return std::any_of(order_.begin() + static_cast<std::ptrdiff_t>(group.first_body),
                                   order_.begin() + static_cast<std::ptrdiff_t>(group.end_body),
                                   [this](Index body) { return is_kept(body); });
            }));
        if (kept_groups < 2) return;
        for (const Index t : changed_) {
            const Index own = body_of(t);
            if (!is_kept(own) || kept_.is_huge(t)) continue;
            const Primitive p = cells_.primitive(frame, t);
            work_.cells_visited += kept_.for_each_neighbour(
                t, [&](const std::array<std::int32_t, 3>& cell, Index body, std::int32_t first) {
                    if (!map_.may_hit(own, body)) return;
                    kept_.for_each_triangle(first, [&](Index other) {
                        if (changed_at_[at(other)] == change_ && body < own) return;  // found from there
                        meet_kept_one(frame, p, cell, other);
                    });
                });
        }
    }
    /// Kept triangles that are in no cell against all others, of which one of the two moved.
    template <typename Stays>
    void look_around_huge(const Frame& frame, const Stays& stays) {
        for (const Index t : kept_.huge()) {
            const Primitive p = cells_.primitive(frame, t);
            const auto look_at = [&](Index other) {
                if (stays(t) && stays(other)) return;
                ++work_.box_tests;
                add_candidate(p, cells_.primitive(frame, other), repeated_);
            };
            const bool all = !stays(t) || redo_;
            if (!all) {
                for (const Index other : changed_) {
                    if (map_.may_hit(p.body, body_of(other))) look_at(other);
                }
                continue;
            }
            for (const Index body : order_) {
                if (!map_.may_hit(p.body, body)) continue;
                const Range triangles = topology_->bodies[at(body)].triangles;
                for (Index other = triangles.first; other < triangles.end(); ++other) look_at(other);
            }
        }
    }
    static void add_candidate(const Primitive& p, const Primitive& q, std::vector<TrianglePair>& list) {
        if (boxes_overlap(p, q)) {
            list.push_back({std::min(p.triangle, q.triangle), std::max(p.triangle, q.triangle)});
        }
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
            // What an instrument does is felt at once: it comes before what tissues do among themselves.
            for (const bool instruments : {true, false}) {
                const auto wanted = [this, instruments](Index a, Index b) {
                    return (is_instrument(a) || is_instrument(b)) == instruments;
                };
                if (!truncated_) gather_candidates(wanted, flush);
                if (!truncated_) test_huge(frame, wanted);
                if (!truncated_) flush();
            }
        }
        truncated_ = truncated_ || cut_before;
        last_pairs_ = contacts.pairs;
        std::sort(last_pairs_.begin(), last_pairs_.end());
        last_truncated_ = truncated_;
        answered_ = true;
    }
    [[nodiscard]] bool is_instrument(Index body) const {
        return topology_->bodies[at(body)].kind == BodyKind::instrument;
    }
    /// Under limits and when incremental: whether the last answer is this one's, too, because nothing moved since.
    bool is_at_rest(const Frame& frame) {
        const bool told = std::exchange(known_, false) && frame.moved.has_value();
        if (frame.position.cols() != topology_->vertex_count) return false;
        bool rests = last_.cols() != 0 && answered_;
        std::int64_t looked_at = 0;
        if (last_.cols() == 0) {
            last_ = frame.position;
        } else if (told) {
            for_each_told(frame, [&](Index /*body*/, Range part) { looked_at += part.count; });
        } else {
            looked_at = topology_->vertex_count;
        }
        if (!spend(work_.vertices_read, looked_at)) {
            last_.resize(3, 0);
            return false;
        }
        const auto look = [&](Index /*body*/, Range part) {
            for (Index v = part.first; v < part.end(); ++v) {
                if (!vertex_moved(frame, v)) continue;
                rests = false;
                remember(frame, v);
            }
        };
        if (told) {
            for_each_told(frame, look);
        } else {
            look(0, {0, topology_->vertex_count});
        }
        known_ = true;
        if (!rests) answered_ = false;
        return rests;
    }

    static std::size_t at(Index number) { return static_cast<std::size_t>(number); }

    Settings settings_;
    const Topology* topology_ = nullptr;
    const ClusterKernels& kernels_ = cluster_kernels().front();
    std::vector<Index> order_;  ///< bodies that take part
    std::vector<Group> groups_;
    std::vector<Group> active_;  ///< groups that go through the cascade; when incremental those with moving bodies
    double cell_edge_ = 0.0;     ///< m; 0: not chosen yet
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
    bool follows_ = false;
    bool known_ = false;           ///< the frame before was followed
    bool answered_ = true;         ///< detect has seen the changes; until then they add up
    bool moving_ = false;          ///< a body that is not kept moved since
    bool at_rest_ = false;         ///< under limits: nothing moved since the last answer
    bool last_truncated_ = false;  ///< of that answer
    bool redo_ = false;            ///< such bodies are looked at again in this tick
    KeptTriangles kept_;
    std::vector<Following> following_;          ///< per body
    std::vector<Index> leaving_;                ///< bodies
    Matrix3X last_;                             ///< 3×N, m: what positions are compared with
    std::vector<Index> first_triangle_;         ///< N + 1; where the triangles of a vertex start
    std::vector<Index> triangles_of_vertices_;  ///< 3 T
    std::vector<std::uint8_t> takes_part_;      ///< per body
    std::vector<std::uint32_t> changed_at_;     ///< per triangle: the change in which it last moved
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
              .meaning = "keep the maps of bodies that rest, or of which less than half moves, and look only at what "
                         "moved; under limits an answer is kept only while nothing moves at all; without effect "
                         "with swept=on"},
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
