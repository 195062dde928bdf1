// ohc_clustered: the cascade of ohc for meshes whose topology stays. Most of a tick of ohc goes into asking every
// triangle where it is; here only vertices are read, in a stream, and triangles are looked at where something else is
// near. Each level holds sixteen of the next, fixed at the start and compact in space (clusters.hpp):
//
//   blocks     up to 64 vertices, cut where their order jumps: boxes by minimum and maximum in memory order; what did
//              not move since it was last read is left alone (block_boxes.hpp)                             [update]
//   regions    16 groups: box = union over the blocks they touch. Cell, object and primitive map (cell_map.hpp) with
//              regions as primitives give the pairs of regions that share a cell, over all bodies at once and each pair
//              once; the list is made anew only when a region leaves the cells it was entered with
//   groups     16 clusters; of regions whose boxes overlap. From here down it is always the same step: a box against
//              sixteen at a time (cluster_kernels.hpp)
//   clusters   16 triangles; of groups whose boxes overlap: the group's vertices are taken over in float
//   triangles  of clusters whose boxes overlap: candidates are pairs of triangles whose boxes overlap
//   pairs      the exact test (narrow_phase.hpp); with swept=on also what begins on the way (swept.hpp)     [detect]
//
// Nothing is lost on the way: each box encloses what it stands for, cell numbers (lattice.hpp) and floats
// (cluster_kernels.hpp) are monotone functions of coordinates, so that what overlaps keeps overlapping. Pairs of groups
// of which neither moved are not looked at: their triangle pairs are those of the tick before. With swept=on every box
// holds both ends of the tick, and all of it is made anew in every tick.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "detect/block_boxes.hpp"
#include "detect/cell_map.hpp"
#include "detect/cluster_kernels.hpp"
#include "detect/clusters.hpp"
#include "detect/lattice.hpp"
#include "detect/narrow_phase.hpp"
#include "detect/pair_sort.hpp"
#include "detect/shared_parameters.hpp"
#include "detect/swept.hpp"
#include "detect/triangle_filter.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

/// More cells than this, and a region is not hashed but paired with every other.
constexpr double most_cells = 512.0;

struct Settings {
    ClusterOrder order = ClusterOrder::automatic;
    TriangleTest test = TriangleTest::exact;
    bool scalar = false;
    bool swept = false;
    std::int64_t max_pairs = std::numeric_limits<std::int64_t>::max();
    std::int64_t work_budget = std::numeric_limits<std::int64_t>::max();
    [[nodiscard]] bool limited() const {
        return max_pairs != std::numeric_limits<std::int64_t>::max() ||
               work_budget != std::numeric_limits<std::int64_t>::max();
    }
};

/// One body during the run.
struct MovingBody {
    Index body = -1;
    ClusteredBody clusters;
    std::unique_ptr<BlockBoxes> boxes;
    std::size_t first_region = 0;    ///< of this body in regions_
    std::vector<std::int32_t> open;  ///< per group: its place in open_groups_, -1 if none
};

/// A region as the cells know it.
struct Region {
    Index owner = -1;   ///< number in bodies_
    Index number = -1;  ///< of the region in its body
    CellRange range{};  ///< with room to move
    bool entered = false;
    std::int32_t open = -1;  ///< its place in open_regions_
};

/// Two regions by number in regions_, the one of the body with the lower number first.
struct RegionPair {
    Index first = -1;
    Index second = -1;
};

/// A region by its longest edge, m.
struct Sized {
    double size = 0.0;
    Index region = -1;
    bool operator<(const Sized& other) const {
        return size < other.size || (size == other.size && region < other.region);
    }
};

/// Boxes of a region's groups.
struct OpenRegion {
    std::int64_t opened_at = -1;
    SixteenBoxes groups;
};

/// A group whose clusters are looked at. Triangle boxes are made when a cluster is first asked for.
struct OpenGroup {
    SixteenBoxes clusters;
    std::array<std::int32_t, fan> triangles{};  ///< places in triangle_boxes_, -1 if none
    FloatBox box;
    std::size_t points = 0;  ///< where its vertices start in points_; swept: after them those of the frame before
    std::int64_t opened_at = -1;
    std::int64_t asked_at = -1;
    bool with_clusters = false;        ///< `clusters` is up to date
    std::uint32_t with_triangles = 0;  ///< bit per cluster: its triangle boxes are up to date
};

/// A group with the box that its blocks make.
struct GroupRef {
    MovingBody& moving;
    Index number;
    FloatBox box;
};

class OhcClustered final : public Detector {
public:
    explicit OhcClustered(const Settings& settings)
        : settings_(settings),
          kernels_(settings.scalar ? cluster_kernels().back() : cluster_kernels().front()),
          filter_(settings.scalar ? triangle_filters().back().decide : triangle_filters().front().decide) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        const auto count = static_cast<std::size_t>(topology.body_count());
        const std::size_t words = (count + 63) / 64;
        std::vector<std::uint64_t> collide(count * words, 0);
        tested_.assign(count, false);
        for (const auto& [a, b] : topology.body_pairs) {
            for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
                const auto number = static_cast<std::size_t>(to);
                collide[static_cast<std::size_t>(from) * words + number / 64] |= std::uint64_t{1} << (number % 64);
                tested_[static_cast<std::size_t>(from)] = true;
            }
        }
        map_.prepare(std::move(collide), words, CellHash::fibonacci, 10);
        last_pairs_.clear();
        ready_ = false;
        if (is_answerable(topology, frame)) build(frame);
    }

    void update(const Frame& frame) override {
        work_ = {};
        truncated_ = false;
        way_ = false;
        if (frame.position.cols() != topology_->vertex_count) {
            answerable_ = false;
            ready_ = false;
            return;
        }
        if (!ready_) {
            answerable_ = is_answerable(*topology_, frame);
            if (answerable_) build(frame);
        }
        if (ready_) {
            way_ = settings_.swept && has_way(*topology_, frame);
            const bool whole = !known_ || !frame.moved || settings_.swept;
            const std::int64_t vertices = whole ? topology_->vertex_count : ask(*frame.moved);
            if (spend(work_.vertices_read, way_ ? 2 * vertices : vertices)) {
                answerable_ = read(frame, whole);
                known_ = answerable_;
            } else {
                known_ = false;
                answerable_ = is_answerable(*topology_, frame);
            }
        }
        work_of_update_ = work_;
        truncated_in_update_ = truncated_;
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!answerable_) {
            if (!check_frame(*topology_, frame, contacts)) return;
            contacts.outcome = {OutcomeKind::unsupported, "detect was called with another frame than update"};
            return;
        }
        work_ = work_of_update_;
        truncated_ = truncated_in_update_;
        candidates_.clear();
        if (bodies_.size() > 1) {
            if (settings_.limited()) test_last_pairs(frame, contacts);
            if (!truncated_) find_region_pairs();
            if (!truncated_) find_meetings();
            for (std::size_t k = 0; k < meetings_.size() && !truncated_; ++k) pair_regions(frame, meetings_[k]);
            test_candidates(frame, contacts);
            keep_unmoved_pairs(contacts);
        }
        sort_pairs(contacts.pairs, sorting_);
        sort_swept(contacts.swept);
        last_pairs_ = contacts.pairs;
        answered_at_ = truncated_ || settings_.limited() || settings_.swept ? never : now_;
        contacts.work = work_;
        contacts.truncated = truncated_;
    }

private:
    static constexpr std::int64_t never = -1;

    bool spend(std::int64_t& counter, std::int64_t amount) {
        if (amount > settings_.work_budget - work_.work()) {
            truncated_ = true;
            return false;
        }
        counter += amount;
        return true;
    }

    [[nodiscard]] bool moved(std::int64_t moved_at) const { return moved_at > answered_at_; }
    MovingBody& owner_of(const Region& region) { return bodies_[static_cast<std::size_t>(region.owner)]; }
    [[nodiscard]] const BlockBoxes& boxes_of(const Region& region) const {
        return *bodies_[static_cast<std::size_t>(region.owner)].boxes;
    }
    [[nodiscard]] const Extent& extent_of(const Region& region) const { return boxes_of(region).region(region.number); }

    // ---- before the first tick ----

    void build(const Frame& frame) {
        bodies_.clear();
        regions_.clear();
        region_pairs_.clear();
        forget_opened();
        unused_vertices_.clear();
        for (Index body = 0; body < topology_->body_count(); ++body) {
            const BodyRange& range = topology_->bodies[static_cast<std::size_t>(body)];
            if (!tested_[static_cast<std::size_t>(body)] || range.triangles.count == 0) {
                unused_vertices_.push_back(range.vertices);
                continue;
            }
            MovingBody moving;
            moving.body = body;
            moving.clusters = cluster_body(*topology_, frame, range, settings_.order);
            moving.open.assign(static_cast<std::size_t>(moving.clusters.group_count), -1);
            bodies_.push_back(std::move(moving));
        }
        // Under a limit instruments come first, so that what is cut off concerns them least.
        std::stable_partition(bodies_.begin(), bodies_.end(), [this](const MovingBody& moving) {
            return !settings_.limited() || kind_of(moving) == BodyKind::instrument;
        });
        place_of_triangle_.assign(static_cast<std::size_t>(topology_->triangle_count()), -1);
        owner_of_body_.assign(static_cast<std::size_t>(topology_->body_count()), -1);
        for (std::size_t owner = 0; owner < bodies_.size(); ++owner) {
            MovingBody& moving = bodies_[owner];
            owner_of_body_[static_cast<std::size_t>(moving.body)] = static_cast<Index>(owner);
            moving.boxes = std::make_unique<BlockBoxes>(moving.clusters, kernels_);
            moving.first_region = regions_.size();
            for (Index r = 0; r < moving.clusters.region_count; ++r) {
                Region& region = regions_.emplace_back();
                region.owner = static_cast<Index>(owner);
                region.number = r;
            }
            for (std::size_t place = 0; place < moving.clusters.triangle.size(); ++place) {
                const Index t = moving.clusters.triangle[place];
                if (t >= 0) place_of_triangle_[static_cast<std::size_t>(t)] = static_cast<Index>(place);
            }
        }
        make_room();
        answered_at_ = never;
        ready_ = true;
        cells_are_set_ = false;
        known_ = read(frame, true);
    }
    /// Room for everything in small scenes and for an ordinary contact in large ones, so that ticks need not ask for
    /// memory.
    void make_room() {
        std::size_t groups = 0;
        std::size_t clusters = 0;
        std::size_t points = 0;
        for (const MovingBody& moving : bodies_) {
            groups += moving.open.size();
            clusters += static_cast<std::size_t>(moving.clusters.cluster_count);
            points += moving.clusters.vertices_of_group.member.size();
        }
        open_regions_.reserve(regions_.size());
        open_groups_.reserve(std::min<std::size_t>(groups, 512));
        triangle_boxes_.reserve(std::min<std::size_t>(clusters, 2048));
        points_.reserve(std::min<std::size_t>(points, 65536));
        region_pairs_.reserve(2 * regions_.size());
        meetings_.reserve(2 * regions_.size());
        by_size_.reserve(2 * regions_.size());
        constexpr std::size_t ordinary = 4096;
        map_.reserve(ordinary);
        candidates_.reserve(ordinary);
        unused_moved_.reserve(unused_vertices_.empty() ? 0 : ordinary);
        sorting_.reserve(ordinary);
        last_pairs_.reserve(ordinary);
    }
    [[nodiscard]] BodyKind kind_of(const MovingBody& moving) const {
        return topology_->bodies[static_cast<std::size_t>(moving.body)].kind;
    }

    /// Cells about as large as the median region, counted from it: a vertex far away makes one region large and none of
    /// the cells.
    void choose_cells() {
        by_size_.clear();
        for (std::size_t k = 0; k < regions_.size(); ++k) {
            by_size_.push_back({longest_edge(extent_of(regions_[k])), static_cast<Index>(k)});
        }
        cells_are_set_ = true;
        if (by_size_.empty()) return;
        const Sized median = median_size();
        const Extent& box = extent_of(regions_[static_cast<std::size_t>(median.region)]);
        lattice_.set(median.size > 0.0 && std::isfinite(median.size) ? median.size : 1.0,
                     Vector3(box.low[0], box.low[1], box.low[2]));
    }

    static double longest_edge(const Extent& box) {
        return std::max({box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]});
    }
    /// Of by_size_, which must not be empty.
    Sized median_size() {
        const auto middle = by_size_.begin() + static_cast<std::ptrdiff_t>(by_size_.size() / 2);
        std::nth_element(by_size_.begin(), middle, by_size_.end());
        return *middle;
    }

    // ---- update ----

    /// How many vertices `read` will look at when these moved: blocks are read as a whole.
    std::int64_t ask(const std::vector<Range>& ranges) {
        unused_moved_.clear();
        std::int64_t vertices = 0;
        for (const Range& unused : unused_vertices_) {
            for (const Range& range : ranges) {
                const Index first = std::max(range.first, unused.first);
                const Index end = std::min(range.end(), unused.end());
                if (first >= end) continue;
                unused_moved_.push_back({first, end - first});
                vertices += end - first;
            }
        }
        for (const MovingBody& moving : bodies_) vertices += moving.boxes->ask(ranges, now_ + 1);
        return vertices;
    }

    static bool finite(const Frame& frame, Range range) {
        return (frame.position.middleCols(range.first, range.count).array() * 0.0).sum() == 0.0;
    }

    /// Boxes of all blocks and regions that moved, and the cells of those regions; false when a number is not finite.
    bool read(const Frame& frame, bool whole) {
        ++now_;
        bool all_finite = true;
        for (const Range& range : whole ? unused_vertices_ : unused_moved_) all_finite &= finite(frame, range);
        for (const MovingBody& moving : bodies_) {
            if (settings_.swept) {
                all_finite &= moving.boxes->read_swept(frame, way_, now_);
            } else if (whole) {
                all_finite &= moving.boxes->read_all(frame, now_);
            } else {
                all_finite &= moving.boxes->read_asked(frame, now_);
            }
        }
        if (!all_finite) return false;
        if (!cells_are_set_) choose_cells();
        for (const MovingBody& moving : bodies_) {
            for (const Index r : moving.boxes->moved_regions()) {
                enter(regions_[moving.first_region + static_cast<std::size_t>(r)]);
            }
        }
        return true;
    }

    /// Gives a region that left its cells new ones, with half a cell of room on all sides.
    void enter(Region& region) {
        const Extent& box = extent_of(region);
        const Vector3 low(box.low[0], box.low[1], box.low[2]);
        const Vector3 high(box.high[0], box.high[1], box.high[2]);
        const CellRange now{lattice_.cell(low), lattice_.cell(high)};
        if (region.entered && region.range.contains(now)) return;
        const Vector3 room = Vector3::Constant(0.5 * lattice_.edge());
        region.range = {lattice_.cell(low - room), lattice_.cell(high + room)};
        region.entered = true;
        region_pairs_known_ = false;
    }

    // ---- regions ----

    /// Pairs of regions that share a cell, each once.
    void find_region_pairs() {
        if (region_pairs_known_) return;
        region_pairs_.clear();
        large_.clear();
        double cells = 0.0;
        for (std::size_t k = 0; k < regions_.size(); ++k) {
            const double count = regions_[k].range.cell_count();
            if (count > most_cells) {
                large_.push_back(static_cast<Index>(k));
            } else {
                cells += count;
            }
        }
        if (!spend(work_.cells_visited, static_cast<std::int64_t>(cells))) return;
        map_.start(static_cast<std::size_t>(cells));
        for (std::size_t k = 0; k < regions_.size(); ++k) {
            const CellRange& range = regions_[k].range;
            if (range.cell_count() > most_cells) continue;
            const Index body = owner_of(regions_[k]).body;
            for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
                for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
                    for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
                        map_.add(Cell{x, y, z, 0}, body, static_cast<Index>(k));
                    }
                }
            }
        }
        map_.cascade();
        map_.for_each_meeting([this](const std::array<std::int32_t, 3>& cell, std::span<const Index> first,
                                     std::span<const Index> second) {
            for (const Index i : first) {
                const Cell p = regions_[static_cast<std::size_t>(i)].range.low;
                for (const Index j : second) {
                    const Cell q = regions_[static_cast<std::size_t>(j)].range.low;
                    // Of the cells that two share, the one where both have begun stands for the pair.
                    if (cell[0] == std::max(p[0], q[0]) && cell[1] == std::max(p[1], q[1]) &&
                        cell[2] == std::max(p[2], q[2])) {
                        region_pairs_.push_back({i, j});
                    }
                }
            }
            return true;
        });
        for (const Index large : large_) {
            const Index body = owner_of(regions_[static_cast<std::size_t>(large)]).body;
            for (std::size_t j = 0; j < regions_.size(); ++j) {
                // Two large ones meet once, from the one that comes first.
                if (regions_[j].range.cell_count() > most_cells && j <= static_cast<std::size_t>(large)) continue;
                const Index other = owner_of(regions_[j]).body;
                if (!map_.may_hit(body, other)) continue;
                const auto number = static_cast<Index>(j);
                region_pairs_.push_back(body < other ? RegionPair{large, number} : RegionPair{number, large});
            }
        }
        region_pairs_known_ = true;
    }

    /// Of those pairs, the ones whose boxes overlap and of which at least one region moved.
    void find_meetings() {
        meetings_.clear();
        by_size_.clear();
        for (const RegionPair& pair : region_pairs_) {
            const Region& first = regions_[static_cast<std::size_t>(pair.first)];
            const Region& second = regions_[static_cast<std::size_t>(pair.second)];
            if (!moved(boxes_of(first).region_moved_at(first.number)) &&
                !moved(boxes_of(second).region_moved_at(second.number))) {
                continue;
            }
            if (!spend(work_.box_tests, 1)) return;
            if (!extent_of(first).overlaps(extent_of(second))) continue;
            meetings_.push_back(pair);
            by_size_.push_back(std::min(Sized{longest_edge(extent_of(first)), pair.first},
                                        Sized{longest_edge(extent_of(second)), pair.second}));
        }
        if (meetings_.empty()) return;
        choose_floats();
        // Contact wanders; what it left behind must not pile up.
        constexpr std::size_t some = 16;
        if (open_groups_.size() > 2 * std::exchange(groups_asked_, 0) + some) forget_opened();
    }

    /// Floats tell most apart near their origin, which therefore lies in the median of the regions that meet, of each
    /// two the smaller one: what a vertex far away makes large does not matter. What is opened stays valid as long as
    /// the old choice will do.
    void choose_floats() {
        const Sized median = median_size();
        const Extent& box = extent_of(regions_[static_cast<std::size_t>(median.region)]);
        std::array<double, 3> centre{};
        double away = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            centre[k] = 0.5 * box.low[k] + 0.5 * box.high[k];
            away = std::max(away, std::abs(centre[k] - floats_.origin[k]));
        }
        const double length = median.size * floats_.scale;
        constexpr double near = 64.0;
        if (away * floats_.scale <= near && length <= near && length >= 1.0 / near) return;
        // Powers of two that exist.
        const double scale =
            median.size > 0.0 ? std::ldexp(1.0, std::clamp(-std::ilogb(median.size), -1020, 1020)) : 1.0;
        if (floats_.origin == centre && floats_.scale == scale) return;
        floats_ = {centre, scale};
        forget_opened();
    }

    void forget_opened() {
        for (MovingBody& moving : bodies_) std::fill(moving.open.begin(), moving.open.end(), -1);
        for (Region& region : regions_) region.open = -1;
        open_regions_.clear();
        open_groups_.clear();
        points_.clear();
        triangle_boxes_.clear();
    }

    float to_float(double x, std::size_t axis) const {
        return static_cast<float>((x - floats_.origin[axis]) * floats_.scale);
    }
    [[nodiscard]] FloatBox to_float(const Extent& box) const {
        FloatBox result{};
        for (std::size_t k = 0; k < 3; ++k) {
            result.low[k] = to_float(box.low[k], k);
            result.high[k] = to_float(box.high[k], k);
        }
        return result;
    }

    /// Boxes of the region's groups, as unions of blocks.
    bool open_region(Region& region) {
        const BlockBoxes& boxes = boxes_of(region);
        if (region.open < 0) {
            region.open = static_cast<std::int32_t>(open_regions_.size());
            open_regions_.emplace_back();
        }
        OpenRegion& opened = open_regions_[static_cast<std::size_t>(region.open)];
        if (opened.opened_at >= boxes.region_moved_at(region.number)) return true;
        const ClusteredBody& clusters = owner_of(region).clusters;
        const Index first = region.number * fan;
        const Index end = std::min(first + fan, clusters.group_count);
        if (!spend(work_.box_tests, clusters.blocks_of_group.first[static_cast<std::size_t>(end)] -
                                        clusters.blocks_of_group.first[static_cast<std::size_t>(first)])) {
            return false;
        }
        empty(opened.groups);
        for (Index g = first; g < end; ++g) {
            Extent box;
            for (const Index* b = clusters.blocks_of_group.begin(g); b != clusters.blocks_of_group.end(g); ++b) {
                box.add(boxes.block(*b));
            }
            const FloatBox in_float = to_float(box);
            for (std::size_t k = 0; k < 3; ++k) {
                opened.groups.low[k][static_cast<std::size_t>(g - first)] = in_float.low[k];
                opened.groups.high[k][static_cast<std::size_t>(g - first)] = in_float.high[k];
            }
        }
        opened.opened_at = now_;
        return true;
    }

    /// Boxes that overlap nothing, not even what reaches from one infinity to the other.
    static void empty(SixteenBoxes& boxes) {
        for (std::size_t k = 0; k < 3; ++k) {
            boxes.low[k].fill(std::numeric_limits<float>::quiet_NaN());
            boxes.high[k].fill(std::numeric_limits<float>::quiet_NaN());
        }
    }

    /// Adds other boxes, each to that of the same number.
    static void unite(const SixteenBoxes& other, SixteenBoxes& boxes) {
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t i = 0; i < boxes.low[k].size(); ++i) {
                boxes.low[k][i] = std::min(boxes.low[k][i], other.low[k][i]);
                boxes.high[k][i] = std::max(boxes.high[k][i], other.high[k][i]);
            }
        }
    }

    void pair_regions(const Frame& frame, const RegionPair& pair) {
        Region& first = regions_[static_cast<std::size_t>(pair.first)];
        Region& second = regions_[static_cast<std::size_t>(pair.second)];
        if (!open_region(first) || !open_region(second)) return;
        // (Places, not references: opening groups must not matter to what is held here.)
        const SixteenBoxes& first_groups = open_regions_[static_cast<std::size_t>(first.open)].groups;
        const SixteenBoxes& second_groups = open_regions_[static_cast<std::size_t>(second.open)].groups;
        if (!spend(work_.box_tests, fan)) return;
        std::uint32_t near = kernels_.overlaps(first_groups, to_float(extent_of(second)));
        if (!spend(work_.box_tests, fan * std::popcount(near))) return;
        SixteenRows rows;
        kernels_.rows(first_groups, near, second_groups, rows);
        for (; near != 0; near &= near - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(near));
            std::uint32_t row = rows[i];
            if (row == 0) continue;
            const Index group = first.number * fan + static_cast<Index>(i);
            const bool first_moved = moved(boxes_of(first).group_moved_at(group));
            for (; row != 0; row &= row - 1) {
                const auto j = static_cast<std::size_t>(std::countr_zero(row));
                const Index other = second.number * fan + static_cast<Index>(j);
                if (!first_moved && !moved(boxes_of(second).group_moved_at(other))) continue;
                const GroupRef p{owner_of(first), group, FloatBox::of(first_groups, i)};
                const GroupRef q{owner_of(second), other, FloatBox::of(second_groups, j)};
                if (!pair_groups(frame, p, q)) return;
            }
        }
    }

    // ---- groups ----

    /// Place of the group in open_groups_, with its vertices in float and their box up to date; -1 when the work would
    /// be too much.
    std::int32_t open_group(const Frame& frame, MovingBody& moving, Index group) {
        const ClusteredBody& clusters = moving.clusters;
        std::int32_t& place = moving.open[static_cast<std::size_t>(group)];
        const Index count = clusters.vertices_of_group.count(group);
        if (place < 0) {
            place = static_cast<std::int32_t>(open_groups_.size());
            OpenGroup& fresh = open_groups_.emplace_back();
            fresh.points = points_.size();
            fresh.triangles.fill(-1);
            points_.resize(points_.size() + static_cast<std::size_t>(settings_.swept ? 2 * count : count));
        }
        OpenGroup& opened = open_groups_[static_cast<std::size_t>(place)];
        if (std::exchange(opened.asked_at, now_) != now_) ++groups_asked_;
        if (opened.opened_at >= moving.boxes->group_moved_at(group)) return place;
        if (!spend(work_.vertices_read, way_ ? 2 * count : count)) return -1;
        const Index* const vertices = clusters.vertices_of_group.begin(group);
        FloatPoint* const points = points_.data() + opened.points;
        kernels_.to_floats(frame.position.data(), vertices, count, floats_, points, opened.box);
        if (way_) {
            FloatBox before{};
            kernels_.to_floats(frame.previous.data(), vertices, count, floats_, points + count, before);
            for (std::size_t k = 0; k < 3; ++k) {
                opened.box.low[k] = std::min(opened.box.low[k], before.low[k]);
                opened.box.high[k] = std::max(opened.box.high[k], before.high[k]);
            }
        }
        opened.with_clusters = false;
        opened.with_triangles = 0;
        opened.opened_at = now_;
        return place;
    }

    /// Boxes of the clusters of an open group.
    const SixteenBoxes& clusters_of(const GroupRef& group, OpenGroup& opened) const {
        if (opened.with_clusters) return opened.clusters;
        const ClusteredBody& clusters = group.moving.clusters;
        const FloatPoint* const points = points_.data() + opened.points;
        const Index first = group.number * fan;
        const Index end = std::min(first + fan, clusters.cluster_count);
        if (end - first < fan) empty(opened.clusters);
        const auto box_all = [&](const FloatPoint* from, SixteenBoxes& boxes) {
            for (Index c = first; c < end; ++c) {
                kernels_.box_of_places(from, clusters.vertices_of_cluster.begin(c),
                                       clusters.vertices_of_cluster.count(c), static_cast<std::size_t>(c - first),
                                       boxes);
            }
        };
        box_all(points, opened.clusters);
        if (way_) {
            SixteenBoxes before;
            empty(before);
            box_all(points + clusters.vertices_of_group.count(group.number), before);
            unite(before, opened.clusters);
        }
        opened.with_clusters = true;
        return opened.clusters;
    }

    [[nodiscard]] bool is_open(const GroupRef& group) const {
        const std::int32_t place = group.moving.open[static_cast<std::size_t>(group.number)];
        return place >= 0 && open_groups_[static_cast<std::size_t>(place)].opened_at >=
                                 group.moving.boxes->group_moved_at(group.number);
    }

    /// Opens the smaller one first, if neither is open: most others need not be opened to see that they are clear of
    /// its clusters. False when the work would be too much.
    bool pair_groups(const Frame& frame, const GroupRef& p, const GroupRef& q) {
        const bool p_first = is_open(p) || (!is_open(q) && p.box.size() <= q.box.size());
        const GroupRef& first = p_first ? p : q;
        const GroupRef& second = p_first ? q : p;
        const std::int32_t place = open_group(frame, first.moving, first.number);
        if (place < 0) return false;
        if (!spend(work_.box_tests, fan)) return false;
        const auto clear_of = [&](const FloatBox& box) {
            return kernels_.overlaps(clusters_of(first, open_groups_[static_cast<std::size_t>(place)]), box) == 0;
        };
        if (clear_of(second.box)) return true;
        const std::int32_t other_place = open_group(frame, second.moving, second.number);
        if (other_place < 0) return false;
        // Its vertices make a tighter box than its blocks.
        if (!spend(work_.box_tests, fan)) return false;
        if (clear_of(open_groups_[static_cast<std::size_t>(other_place)].box)) return true;

        OpenGroup& p_open = open_groups_[static_cast<std::size_t>(p_first ? place : other_place)];
        OpenGroup& q_open = open_groups_[static_cast<std::size_t>(p_first ? other_place : place)];
        if (!spend(work_.box_tests, fan)) return false;
        const SixteenBoxes& p_clusters = clusters_of(p, p_open);
        const SixteenBoxes& q_clusters = clusters_of(q, q_open);
        std::uint32_t near = kernels_.overlaps(p_clusters, q_open.box);
        if (!spend(work_.box_tests, fan * std::popcount(near))) return false;
        SixteenRows rows;
        kernels_.rows(p_clusters, near, q_clusters, rows);
        for (; near != 0; near &= near - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(near));
            for (std::uint32_t row = rows[i]; row != 0; row &= row - 1) {
                const auto j = static_cast<std::size_t>(std::countr_zero(row));
                if (!pair_clusters(p.moving.clusters, p.number, p_open, i, q.moving.clusters, q.number, q_open, j)) {
                    return false;
                }
            }
        }
        return true;
    }

    // ---- clusters ----

    /// Place of the cluster's triangle boxes in triangle_boxes_.
    std::size_t open_cluster(const ClusteredBody& clusters, Index group, OpenGroup& opened, std::size_t i) {
        std::int32_t& place = opened.triangles[i];
        if (((opened.with_triangles >> i) & 1U) == 0) {
            if (place < 0) {
                place = static_cast<std::int32_t>(triangle_boxes_.size());
                triangle_boxes_.emplace_back();
            }
            const auto cluster = static_cast<std::size_t>(group) * fan + i;
            const FloatPoint* const points = points_.data() + opened.points;
            SixteenBoxes& boxes = triangle_boxes_[static_cast<std::size_t>(place)];
            kernels_.boxes_of_triangles(points, clusters.corners[cluster], boxes);
            if (way_) {
                SixteenBoxes before;
                kernels_.boxes_of_triangles(points + clusters.vertices_of_group.count(group), clusters.corners[cluster],
                                            before);
                unite(before, boxes);
            }
            opened.with_triangles |= 1U << i;
        }
        return static_cast<std::size_t>(place);
    }

    /// Candidates of two clusters whose boxes overlap; the first belongs to the body with the lower number.
    bool pair_clusters(const ClusteredBody& first, Index group, OpenGroup& p, std::size_t i,
                       const ClusteredBody& second, Index other, OpenGroup& q, std::size_t j) {
        const std::size_t first_place = open_cluster(first, group, p, i);
        const std::size_t second_place = open_cluster(second, other, q, j);
        const SixteenBoxes& first_boxes = triangle_boxes_[first_place];
        const SixteenBoxes& second_boxes = triangle_boxes_[second_place];
        if (!spend(work_.box_tests, fan)) return false;
        const std::size_t first_cluster = static_cast<std::size_t>(group) * fan + i;
        const std::size_t second_cluster = static_cast<std::size_t>(other) * fan + j;
        std::uint32_t near = kernels_.overlaps(first_boxes, FloatBox::of(q.clusters, j));
        if (!spend(work_.box_tests, fan * std::popcount(near))) return false;
        const Index* const first_triangle = first.triangle.data() + first_cluster * fan;
        const Index* const second_triangle = second.triangle.data() + second_cluster * fan;
        SixteenRows rows;
        kernels_.rows(first_boxes, near, second_boxes, rows);
        for (; near != 0; near &= near - 1) {
            const auto s = static_cast<std::size_t>(std::countr_zero(near));
            for (std::uint32_t row = rows[s]; row != 0; row &= row - 1) {
                const auto t = static_cast<std::size_t>(std::countr_zero(row));
                if (first_triangle[s] >= 0 && second_triangle[t] >= 0) {
                    candidates_.push_back({first_triangle[s], second_triangle[t]});
                }
            }
        }
        return true;
    }

    // ---- pairs ----

    void test_candidates(const Frame& frame, ContactSet& contacts) {
        if (!settings_.limited()) {
            const auto count = static_cast<std::int64_t>(candidates_.size());
            work_.triangle_tests += way_ ? 2 * count : count;
            test_pairs(settings_.test, *topology_, frame, candidates_, contacts.pairs, filter_);
            if (way_) test_swept(*topology_, frame, candidates_, contacts.swept);
            return;
        }
        for (const TrianglePair& pair : candidates_) {
            if (std::binary_search(last_pairs_.begin(), last_pairs_.end(), pair)) continue;
            if (!test_one(frame, pair, contacts)) return;
        }
    }
    /// Under limits the pairs of the last tick come first.
    void test_last_pairs(const Frame& frame, ContactSet& contacts) {
        for (const TrianglePair& pair : last_pairs_) {
            if (!test_one(frame, pair, contacts)) return;
        }
    }
    bool test_one(const Frame& frame, const TrianglePair& pair, ContactSet& contacts) {
        if (full(contacts.pairs.size()) || !spend(work_.triangle_tests, 1)) return false;
        test_pairs(settings_.test, *topology_, frame, {&pair, 1}, contacts.pairs, filter_);
        if (!way_ || !either_moved(*topology_, frame, pair)) return true;
        if (full(contacts.swept.size()) || !spend(work_.triangle_tests, 1)) return false;
        test_swept(*topology_, frame, {&pair, 1}, contacts.swept);
        return true;
    }
    /// One more would be more than max_pairs: the tick ends.
    bool full(std::size_t count) {
        if (static_cast<std::int64_t>(count) < settings_.max_pairs) return false;
        truncated_ = true;
        return true;
    }

    [[nodiscard]] bool in_moved_group(Index triangle) const {
        const Index body = topology_->body_of_triangle[static_cast<std::size_t>(triangle)];
        const MovingBody& moving = bodies_[static_cast<std::size_t>(owner_of_body_[static_cast<std::size_t>(body)])];
        return moved(
            moving.boxes->group_moved_at(place_of_triangle_[static_cast<std::size_t>(triangle)] / (fan * fan)));
    }
    /// Pairs of the last answer whose groups both stayed where they were.
    void keep_unmoved_pairs(ContactSet& contacts) const {
        if (answered_at_ == never) return;
        for (const TrianglePair& pair : last_pairs_) {
            if (!in_moved_group(pair.a) && !in_moved_group(pair.b)) contacts.pairs.push_back(pair);
        }
    }

    Settings settings_;
    const ClusterKernels& kernels_;
    TriangleFilter filter_;
    const Topology* topology_ = nullptr;
    std::vector<bool> tested_;
    std::vector<MovingBody> bodies_;        ///< that take part
    std::vector<Index> owner_of_body_;      ///< number in bodies_, -1 if none
    std::vector<Index> place_of_triangle_;  ///< in its body's clusters
    std::vector<Range> unused_vertices_;    ///< of bodies that take no part
    std::vector<Range> unused_moved_;       ///< of those, what moved
    std::vector<Region> regions_;
    Lattice lattice_;
    CellMap map_;
    bool ready_ = false;  ///< clusters are built
    bool cells_are_set_ = false;
    bool known_ = false;               ///< block boxes are those of the last frame
    bool region_pairs_known_ = false;  ///< no region left its cells since the list was made
    bool answerable_ = false;          ///< the last update's frame was
    bool way_ = false;                 ///< swept, and the last update's frame knows the frame before
    bool truncated_ = false;
    bool truncated_in_update_ = false;
    std::int64_t now_ = 0;              ///< counts reads
    std::int64_t answered_at_ = never;  ///< the read that last_pairs_ answers completely
    WorkCounters work_;
    WorkCounters work_of_update_;

    std::vector<RegionPair> region_pairs_;
    std::vector<RegionPair> meetings_;
    std::vector<Sized> by_size_;  ///< what a median is taken of
    std::vector<Index> large_;    ///< regions that cover too many cells

    // What is opened, kept from tick to tick where it did not move.
    FloatFrame floats_;
    std::vector<OpenRegion> open_regions_;
    std::vector<OpenGroup> open_groups_;
    std::size_t groups_asked_ = 0;  ///< of them, since the last tick began
    std::vector<FloatPoint> points_;
    std::vector<SixteenBoxes> triangle_boxes_;

    std::vector<TrianglePair> candidates_;
    std::vector<TrianglePair> sorting_;
    std::vector<TrianglePair> last_pairs_;  ///< sorted: what the tick before reported
};

}  // namespace

DetectorEntry ohc_clustered_detector() {
    using Type = Parameter::Type;
    return {
        .name = "ohc_clustered",
        .configuration =
            std::string("double precision boxes of vertex blocks, float boxes of triangles; exact triangle test; "
                        "one thread; vectors: ") +
            cluster_kernels().front().target,
        .own = true,
        .claims_exact = true,
        .parameters =
            {{.name = "order",
              .type = Type::choice,
              .default_value = "auto",
              .choices = {"auto", "given", "local"},
              .meaning = "vertices and triangles in the caller's order, in one made for locality, or the better one"},
             {.name = "simd",
              .type = Type::choice,
              .default_value = "auto",
              .choices = {"auto", "scalar"},
              .meaning = "the widest vectors the CPU has, or none; the answer is the same"},
             test_parameter(),
             swept_parameter(),
             max_pairs_parameter(),
             work_budget_parameter()},
        .make = [](const ParameterValues& values) {
            Settings settings;
            if (values.is("order", "given")) settings.order = ClusterOrder::given;
            if (values.is("order", "local")) settings.order = ClusterOrder::local;
            settings.scalar = values.is("simd", "scalar");
            settings.swept = values.is("swept", "on");
            settings.test = triangle_test_from(values.text("test"));
            if (!values.is("max_pairs", "none")) settings.max_pairs = values.integer("max_pairs");
            if (!values.is("work_budget", "none")) settings.work_budget = values.integer("work_budget");
            return std::make_unique<OhcClustered>(settings);
        }};
}

}  // namespace trocar
