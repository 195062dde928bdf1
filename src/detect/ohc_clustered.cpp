// ohc_clustered: the cascade of ohc with clusters in place of triangles, for meshes whose topology stays. Most of a
// tick of ohc goes into asking every triangle where it is; here only vertices are read, in a stream, and triangles are
// looked at where something else is near:
//
//   chunks     16 vertices each, fixed at the start: their boxes, by minimum and maximum in memory order    [update]
//   groups     16 clusters of 16 triangles: box = union over the chunk groups they touch; groups that share a coarse
//              cell with another body go on (occupancy.hpp)
//   clusters   of such groups: box = union over their chunks; those that share a fine cell go on
//   opened     the triangles of such clusters get boxes, and the cluster its tight one; cell, object and primitive map
//              (cell_map.hpp) with clusters as primitives give pairs of clusters, each once
//   boxes      16 × 16 triangle boxes of a cluster pair at a time (box_kernel.hpp)
//   triangles  the exact test (narrow_phase.hpp)                                                             [detect]
//
// Nothing is lost on the way: each box encloses what it stands for, cell numbers are monotone (lattice.hpp), boxes in
// float are rounded outward. With `Frame::moved` only the chunks in the moved ranges are read again.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "detect/box_kernel.hpp"
#include "detect/cell_map.hpp"
#include "detect/clusters.hpp"
#include "detect/lattice.hpp"
#include "detect/narrow_phase.hpp"
#include "detect/occupancy.hpp"
#include "detect/shared_parameters.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

/// A box of three lows and three highs, m; empty until something is put in. The fourth numbers are never looked at:
/// they make two registers of each side.
struct alignas(16) Extent {
    std::array<double, 4> low{infinity, infinity, infinity, infinity};
    std::array<double, 4> high{-infinity, -infinity, -infinity, -infinity};
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    void add(const Extent& other) {
        for (std::size_t k = 0; k < 4; ++k) low[k] = other.low[k] < low[k] ? other.low[k] : low[k];
        for (std::size_t k = 0; k < 4; ++k) high[k] = other.high[k] > high[k] ? other.high[k] : high[k];
    }
    [[nodiscard]] bool overlaps(const Extent& other) const {
        unsigned overlap = 1;
        for (std::size_t k = 0; k < 3; ++k) {
            overlap &= static_cast<unsigned>(low[k] <= other.high[k]) & static_cast<unsigned>(other.low[k] <= high[k]);
        }
        return overlap != 0;
    }
    [[nodiscard]] double size() const { return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}); }
};

/// More cells than this, and a cluster is not hashed but held against every opened cluster.
constexpr double most_cells = 512.0;

struct Settings {
    ClusterOrder order = ClusterOrder::automatic;
    TriangleTest test = TriangleTest::exact;
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
    std::vector<Extent> chunk;
    std::vector<Extent> chunk_group;
    std::vector<std::uint8_t> stale;  ///< per chunk: in a moved range
};

/// A group or cluster that takes part in one level: who it is and where.
struct Item {
    Index owner = -1;   ///< number in bodies_
    Index number = -1;  ///< of the group or cluster
    Extent extent;
    CellRange range;
};

/// A cluster whose triangles are looked at.
struct Opened {
    Index owner = -1;
    Index cluster = -1;
    Extent extent;
    CellRange range;
    ClusterBoxes boxes;
};

class OhcClustered final : public Detector {
public:
    explicit OhcClustered(const Settings& settings) : settings_(settings) {}

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
        bodies_.clear();
        ready_ = false;
        if (is_answerable(topology, frame)) build(frame);
    }

    void update(const Frame& frame) override {
        work_ = {};
        truncated_ = false;
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
            const bool whole = !known_ || !frame.moved;
            if (spend(work_.vertices_read, whole ? vertices_in_use_ : moved_vertices(*frame.moved))) {
                answerable_ = whole ? read_all(frame) : read_moved(frame);
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
            if (!truncated_) find_groups();
            if (!truncated_) find_clusters();
            if (!truncated_) open_clusters(frame);
            if (!truncated_) pair_clusters();
            test_candidates(frame, contacts);
        }
        std::sort(contacts.pairs.begin(), contacts.pairs.end());
        if (settings_.limited()) last_pairs_ = contacts.pairs;
        contacts.work = work_;
        contacts.truncated = truncated_;
    }

private:
    bool spend(std::int64_t& counter, std::int64_t amount) {
        if (amount > settings_.work_budget - work_.work()) {
            truncated_ = true;
            return false;
        }
        counter += amount;
        return true;
    }

    // ---- before the first tick ----

    void build(const Frame& frame) {
        bodies_.clear();
        vertices_in_use_ = 0;
        for (Index body = 0; body < topology_->body_count(); ++body) {
            const BodyRange& range = topology_->bodies[static_cast<std::size_t>(body)];
            if (!tested_[static_cast<std::size_t>(body)] || range.triangles.count == 0) continue;
            MovingBody moving;
            moving.body = body;
            moving.clusters = cluster_body(*topology_, frame, range, settings_.order);
            const auto chunks = static_cast<std::size_t>(moving.clusters.chunk_count);
            moving.chunk.resize(chunks);
            moving.chunk_group.resize((chunks + chunk_group_size - 1) / chunk_group_size);
            moving.stale.assign(chunks, 0);
            vertices_in_use_ += range.vertices.count;
            bodies_.push_back(std::move(moving));
        }
        // The smallest first: the last and largest then only looks where the others are. Under a limit instruments
        // come first, so that what is cut off concerns them least.
        const auto rank = [this](const MovingBody& moving) {
            const BodyRange& range = topology_->bodies[static_cast<std::size_t>(moving.body)];
            return std::pair(settings_.limited() && range.kind != BodyKind::instrument, range.triangles.count);
        };
        std::stable_sort(bodies_.begin(), bodies_.end(),
                         [&rank](const MovingBody& a, const MovingBody& b) { return rank(a) < rank(b); });
        ready_ = true;
        known_ = read_all(frame);
        choose_cells(frame);
    }

    /// Cells about as large as the boxes they hold: fine ones for clusters, coarse ones for groups.
    void choose_cells(const Frame& frame) {
        double cluster_sum = 0.0;
        double group_sum = 0.0;
        double clusters = 0.0;
        double groups = 0.0;
        for (const MovingBody& moving : bodies_) {
            for (Index c = 0; c < moving.clusters.cluster_count; ++c) cluster_sum += cluster_extent(moving, c).size();
            for (Index g = 0; g < moving.clusters.group_count; ++g) group_sum += group_extent(moving, g).size();
            clusters += moving.clusters.cluster_count;
            groups += moving.clusters.group_count;
        }
        const auto positive = [](double size) { return size > 0.0 && std::isfinite(size) ? size : 1.0; };
        const Vector3 corner =
            frame.position.cols() > 0 ? Vector3(frame.position.rowwise().minCoeff()) : Vector3::Zero();
        fine_.set(positive(0.5 * cluster_sum / std::max(clusters, 1.0)), corner);
        coarse_.set(positive(0.4 * group_sum / std::max(groups, 1.0)), corner);
    }

    // ---- chunks ----

    using Two = double __attribute__((vector_size(16)));
    static Two load_two(const double* numbers) {
        Two two;
        std::memcpy(&two, numbers, sizeof two);
        return two;
    }
    static Two lesser(Two a, Two b) { return a < b ? a : b; }
    static Two greater(Two a, Two b) { return a > b ? a : b; }

    /// Box of points as they come. A point is read as (x, y) and (y, z), so that nothing behind the last one is
    /// touched.
    struct Gathered {
        Two low_xy = {Extent::infinity, Extent::infinity};
        Two low_yz = low_xy;
        Two high_xy = -low_xy;
        Two high_yz = -low_xy;
        void add(const double* point) {
            const Two xy = load_two(point);
            const Two yz = load_two(point + 1);
            low_xy = lesser(low_xy, xy);
            low_yz = lesser(low_yz, yz);
            high_xy = greater(high_xy, xy);
            high_yz = greater(high_yz, yz);
        }
        void add(const Gathered& other) {
            low_xy = lesser(low_xy, other.low_xy);
            low_yz = lesser(low_yz, other.low_yz);
            high_xy = greater(high_xy, other.high_xy);
            high_yz = greater(high_yz, other.high_yz);
        }
        [[nodiscard]] Extent extent() const {
            return {.low = {low_xy[0], low_xy[1], low_yz[1], 0.0}, .high = {high_xy[0], high_xy[1], high_yz[1], 0.0}};
        }
    };

    static Extent chunk_extent(const Frame& frame, const ClusteredBody& clusters, Index chunk) {
        const Index first = chunk * cluster_size;
        const Index count = std::min(cluster_size, clusters.vertices.count - first);
        const double* const position = frame.position.data();
        Gathered even;  // two at a time, since each minimum waits for the one before
        Gathered odd;
        Index k = 0;
        if (clusters.vertex_order.empty()) {
            const double* const points = position + 3 * static_cast<std::size_t>(clusters.vertices.first + first);
            for (; k + 2 <= count; k += 2) {
                even.add(points + 3 * k);
                odd.add(points + 3 * k + 3);
            }
            if (k < count) even.add(points + 3 * k);
        } else {
            const Index* const order = clusters.vertex_order.data() + first;
            for (; k + 2 <= count; k += 2) {
                even.add(position + 3 * static_cast<std::size_t>(order[k]));
                odd.add(position + 3 * static_cast<std::size_t>(order[k + 1]));
            }
            if (k < count) even.add(position + 3 * static_cast<std::size_t>(order[k]));
        }
        even.add(odd);
        return even.extent();
    }

    /// Boxes of all chunks; false when a number is not finite.
    bool read_all(const Frame& frame) {
        if (!is_answerable(*topology_, frame)) return false;
        for (MovingBody& moving : bodies_) {
            for (std::size_t g = 0; g < moving.chunk_group.size(); ++g) {
                const Index first = static_cast<Index>(g) * chunk_group_size;
                const Index end = std::min(first + chunk_group_size, moving.clusters.chunk_count);
                Extent whole;
                for (Index c = first; c < end; ++c) {
                    const Extent extent = chunk_extent(frame, moving.clusters, c);
                    moving.chunk[static_cast<std::size_t>(c)] = extent;
                    whole.add(extent);
                }
                moving.chunk_group[g] = whole;
            }
        }
        return true;
    }

    static std::int64_t moved_vertices(const std::vector<Range>& ranges) {
        std::int64_t sum = 0;
        for (const Range& range : ranges) sum += range.count;
        return sum;
    }

    /// Boxes of the chunks that hold a vertex in a moved range; all others are as they were.
    bool read_moved(const Frame& frame) {
        for (const Range& range : *frame.moved) {
            const Index first = std::max(range.first, 0);
            const Index end = std::min(range.end(), topology_->vertex_count);
            if (end > first && (frame.position.middleCols(first, end - first).array() * 0.0).sum() != 0.0) return false;
        }
        for (MovingBody& moving : bodies_) {
            const ClusteredBody& clusters = moving.clusters;
            for (const Range& range : *frame.moved) {
                const Index first = std::max(range.first, clusters.vertices.first);
                const Index end = std::min(range.end(), clusters.vertices.end());
                if (first >= end) continue;
                if (clusters.vertex_order.empty()) {
                    const Index from = (first - clusters.vertices.first) / cluster_size;
                    const Index to = (end - 1 - clusters.vertices.first) / cluster_size;
                    for (Index c = from; c <= to; ++c) read_chunk(frame, moving, c);
                } else {
                    for (Index v = first; v < end; ++v) {
                        moving.stale[static_cast<std::size_t>(
                            clusters.chunk_of[static_cast<std::size_t>(v - clusters.vertices.first)])] = 1;
                    }
                }
            }
            if (clusters.vertex_order.empty()) continue;
            for (Index c = 0; c < clusters.chunk_count; ++c) {
                if (std::exchange(moving.stale[static_cast<std::size_t>(c)], std::uint8_t{0}) != 0) {
                    read_chunk(frame, moving, c);
                }
            }
        }
        return true;
    }
    static void read_chunk(const Frame& frame, MovingBody& moving, Index chunk) {
        moving.chunk[static_cast<std::size_t>(chunk)] = chunk_extent(frame, moving.clusters, chunk);
        const Index group = chunk / chunk_group_size;
        Extent whole;
        const Index end = std::min((group + 1) * chunk_group_size, moving.clusters.chunk_count);
        for (Index c = group * chunk_group_size; c < end; ++c) whole.add(moving.chunk[static_cast<std::size_t>(c)]);
        moving.chunk_group[static_cast<std::size_t>(group)] = whole;
    }

    static Extent cluster_extent(const MovingBody& moving, Index cluster) {
        Extent extent;
        const Lists& lists = moving.clusters.chunks_of_cluster;
        for (const Index* c = lists.begin(cluster); c != lists.end(cluster); ++c) {
            extent.add(moving.chunk[static_cast<std::size_t>(*c)]);
        }
        return extent;
    }
    static Extent group_extent(const MovingBody& moving, Index group) {
        Extent extent;
        const Lists& lists = moving.clusters.chunk_groups_of_group;
        for (const Index* g = lists.begin(group); g != lists.end(group); ++g) {
            extent.add(moving.chunk_group[static_cast<std::size_t>(*g)]);
        }
        return extent;
    }

    // ---- two levels of occupancy ----

    static CellRange range_of(const Lattice& lattice, const Extent& extent) {
        return {lattice.cell(Vector3(extent.low[0], extent.low[1], extent.low[2])),
                lattice.cell(Vector3(extent.high[0], extent.high[1], extent.high[2]))};
    }

    /// Groups that share a coarse cell with a group of another body.
    void find_groups() {
        items_.clear();
        for (std::size_t owner = 0; owner < bodies_.size(); ++owner) {
            for (Index g = 0; g < bodies_[owner].clusters.group_count; ++g) {
                const Extent extent = group_extent(bodies_[owner], g);
                items_.push_back({static_cast<Index>(owner), g, extent, range_of(coarse_, extent)});
            }
        }
        keep_shared();
        groups_.swap(items_);
    }

    /// Clusters of those groups that share a fine cell with a cluster of another body.
    void find_clusters() {
        items_.clear();
        for (const Item& group : groups_) {
            const MovingBody& moving = bodies_[static_cast<std::size_t>(group.owner)];
            const Index end = std::min((group.number + 1) * cluster_size, moving.clusters.cluster_count);
            for (Index c = group.number * cluster_size; c < end; ++c) {
                const Extent extent = cluster_extent(moving, c);
                items_.push_back({group.owner, c, extent, range_of(fine_, extent)});
            }
        }
        keep_shared();
    }

    /// Drops from items_ (body by body) those whose cells no other body's item holds.
    void keep_shared() {
        if (!spend(work_.cells_visited, static_cast<std::int64_t>(items_.size()))) return;
        if (items_.empty()) return;
        CellRange whole = items_.front().range;
        for (const Item& item : items_) {
            whole.low = cell_min(whole.low, item.range.low);
            whole.high = cell_max(whole.high, item.range.high);
        }
        cells_tell_ = !Lattice::at_limit(whole);
        if (!cells_tell_) return;  // so far away that cells tell nothing: everything goes on
        occupancy_.start(whole);
        const Index last_owner = items_.back().owner;
        std::size_t first = 0;
        while (items_[first].owner != last_owner) {
            std::size_t end = first;
            CellRange own = items_[first].range;
            for (; items_[end].owner == items_[first].owner; ++end) {
                if (settings_.work_budget != std::numeric_limits<std::int64_t>::max() &&
                    items_[end].range.cell_count() > static_cast<double>(settings_.work_budget - work_.work())) {
                    truncated_ = true;
                    occupancy_.merge(own);  // leaves nothing behind for the next tick
                    return;
                }
                work_.cells_visited += occupancy_.mark(items_[end].range);
                own.low = cell_min(own.low, items_[end].range.low);
                own.high = cell_max(own.high, items_[end].range.high);
            }
            occupancy_.merge(own);
            first = end;
        }
        // The last body looks where the others are, then the others where they meet it or each other.
        kept_.clear();
        for (std::size_t k = first; k < items_.size(); ++k) {
            if (!occupancy_.any_once(items_[k].range)) continue;
            occupancy_.share(items_[k].range);
            kept_.push_back(items_[k]);
        }
        const std::size_t last_kept = kept_.size();
        for (std::size_t k = 0; k < first; ++k) {
            if (occupancy_.any_shared(items_[k].range)) kept_.push_back(items_[k]);
        }
        // Back to body by body, the last one at the end.
        std::rotate(kept_.begin(), kept_.begin() + static_cast<std::ptrdiff_t>(last_kept), kept_.end());
        items_.swap(kept_);
    }

    // ---- opened clusters ----

    void open_clusters(const Frame& frame) {
        opened_.clear();
        large_.clear();
        if (!spend(work_.vertices_read, static_cast<std::int64_t>(items_.size()) * 3 * cluster_size)) return;
        if (items_.empty()) return;
        // Floats are relative to a corner of what is opened, so that they are fine where it matters.
        Extent whole;
        for (const Item& item : items_) whole.add(item.extent);
        origin_ = {whole.low[0], whole.low[1], whole.low[2]};
        beyond_floats_ = !(whole.size() < 1e37);
        opened_.resize(items_.size());
        double cells = 0.0;
        for (std::size_t k = 0; k < items_.size(); ++k) {
            Opened& opened = opened_[k];
            opened.owner = items_[k].owner;
            opened.cluster = items_[k].number;
            fill_boxes(frame, opened);
            opened.range = range_of(fine_, opened.extent);
            const double count = opened.range.cell_count();
            if (count > most_cells) {
                large_.push_back(static_cast<Index>(k));
            } else {
                cells += count;
            }
        }
        map_.start(static_cast<std::size_t>(cells));
        for (std::size_t k = 0; k < opened_.size(); ++k) {
            const CellRange& range = opened_[k].range;
            if (range.cell_count() > most_cells) continue;
            const Index body = bodies_[static_cast<std::size_t>(opened_[k].owner)].body;
            if (!spend(work_.cells_visited, static_cast<std::int64_t>(range.cell_count()))) return;
            for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
                for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
                    for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
                        const Cell cell{x, y, z, 0};
                        if (cells_tell_ && !occupancy_.shared(cell)) continue;
                        map_.add(cell, body, static_cast<Index>(k));
                    }
                }
            }
        }
        map_.cascade();
    }

    // Two units in the last place outward cover all rounding.
    static float round_down(double x) {
        const auto rounded = static_cast<float>(x);
        return rounded - (std::abs(rounded) * 2.5e-7F + 1e-37F);
    }
    static float round_up(double x) {
        const auto rounded = static_cast<float>(x);
        return rounded + (std::abs(rounded) * 2.5e-7F + 1e-37F);
    }

    void fill_boxes(const Frame& frame, Opened& opened) const {
        const ClusteredBody& clusters = bodies_[static_cast<std::size_t>(opened.owner)].clusters;
        const std::array<Index, 3>* const corner =
            clusters.corner.data() + static_cast<std::size_t>(opened.cluster) * cluster_size;
        const double* const position = frame.position.data();
        // A point is read as (x, y) and (y, z), so that nothing behind the last one is touched.
        const auto xy = [position](Index v) { return load_two(position + 3 * static_cast<std::size_t>(v)); };
        const auto yz = [position](Index v) { return load_two(position + 3 * static_cast<std::size_t>(v) + 1); };
        std::array<std::array<double, 16>, 3> low;
        std::array<std::array<double, 16>, 3> high;
        const Two origin_xy = load_two(origin_.data());
        const Two origin_yz = load_two(origin_.data() + 1);
        Two low_xy = {Extent::infinity, Extent::infinity};
        Two low_yz = low_xy;
        Two high_xy = -low_xy;
        Two high_yz = -low_xy;
        for (std::size_t t = 0; t < 16; ++t) {
            const auto [a, b, c] = corner[t];
            Two first = lesser(lesser(xy(a), xy(b)), xy(c));
            Two second = lesser(lesser(yz(a), yz(b)), yz(c));
            low_xy = lesser(low_xy, first);
            low_yz = lesser(low_yz, second);
            first -= origin_xy;
            second -= origin_yz;
            low[0][t] = first[0];
            low[1][t] = first[1];
            low[2][t] = second[1];
            first = greater(greater(xy(a), xy(b)), xy(c));
            second = greater(greater(yz(a), yz(b)), yz(c));
            high_xy = greater(high_xy, first);
            high_yz = greater(high_yz, second);
            first -= origin_xy;
            second -= origin_yz;
            high[0][t] = first[0];
            high[1][t] = first[1];
            high[2][t] = second[1];
        }
        opened.extent.low = {low_xy[0], low_xy[1], low_yz[1], 0.0};
        opened.extent.high = {high_xy[0], high_xy[1], high_yz[1], 0.0};
        if (beyond_floats_) {
            for (std::size_t k = 0; k < 3; ++k) {
                opened.boxes.low[k].fill(-std::numeric_limits<float>::max());
                opened.boxes.high[k].fill(std::numeric_limits<float>::max());
            }
            return;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t t = 0; t < 16; ++t) opened.boxes.low[k][t] = round_down(low[k][t]);
            for (std::size_t t = 0; t < 16; ++t) opened.boxes.high[k][t] = round_up(high[k][t]);
        }
    }

    // ---- pairs ----

    void pair_clusters() {
        map_.for_each_meeting([this](const std::array<std::int32_t, 3>& cell, std::span<const Index> first,
                                     std::span<const Index> second) {
            if (!spend(work_.box_tests, static_cast<std::int64_t>(first.size() * second.size()))) return false;
            for (const Index i : first) {
                const Opened& p = opened_[static_cast<std::size_t>(i)];
                for (const Index j : second) {
                    const Opened& q = opened_[static_cast<std::size_t>(j)];
                    const bool reference = cell[0] == std::max(p.range.low[0], q.range.low[0]) &&
                                           cell[1] == std::max(p.range.low[1], q.range.low[1]) &&
                                           cell[2] == std::max(p.range.low[2], q.range.low[2]);
                    if (reference && p.extent.overlaps(q.extent) && !pair_triangles(p, q)) return false;
                }
            }
            return true;
        });
        for (std::size_t k = 0; k < large_.size() && !truncated_; ++k) {
            const Opened& p = opened_[static_cast<std::size_t>(large_[k])];
            if (!spend(work_.box_tests, static_cast<std::int64_t>(opened_.size()))) return;
            for (std::size_t j = 0; j < opened_.size(); ++j) {
                const Opened& q = opened_[j];
                // Two large ones meet once, from the one that comes first.
                if (q.range.cell_count() > most_cells && j <= static_cast<std::size_t>(large_[k])) continue;
                const Index body_p = bodies_[static_cast<std::size_t>(p.owner)].body;
                const Index body_q = bodies_[static_cast<std::size_t>(q.owner)].body;
                if (!map_.may_hit(body_p, body_q) || !p.extent.overlaps(q.extent)) continue;
                if (!(body_p < body_q ? pair_triangles(p, q) : pair_triangles(q, p))) return;
            }
        }
    }

    /// Candidates of two clusters whose boxes overlap; p belongs to the body with the lower number.
    bool pair_triangles(const Opened& p, const Opened& q) {
        std::array<float, 3> low{};
        std::array<float, 3> high{};
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = beyond_floats_ ? -std::numeric_limits<float>::max() : round_down(q.extent.low[k] - origin_[k]);
            high[k] = beyond_floats_ ? std::numeric_limits<float>::max() : round_up(q.extent.high[k] - origin_[k]);
        }
        if (!spend(work_.box_tests, cluster_size)) return false;
        const std::uint32_t near = kernels_.mask(p.boxes, low, high);
        if (near == 0) return true;
        if (!spend(work_.box_tests, static_cast<std::int64_t>(std::popcount(near)) * cluster_size)) return false;
        std::array<std::uint16_t, 16> overlap{};
        kernels_.overlaps(p.boxes, near, q.boxes, overlap);
        const Index* const first = bodies_[static_cast<std::size_t>(p.owner)].clusters.triangle.data() +
                                   static_cast<std::size_t>(p.cluster) * cluster_size;
        const Index* const second = bodies_[static_cast<std::size_t>(q.owner)].clusters.triangle.data() +
                                    static_cast<std::size_t>(q.cluster) * cluster_size;
        for (std::uint32_t rest = near; rest != 0; rest &= rest - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(rest));
            for (std::uint32_t bits = overlap[i]; bits != 0; bits &= bits - 1) {
                const auto j = static_cast<std::size_t>(std::countr_zero(bits));
                if (first[i] >= 0 && second[j] >= 0) candidates_.push_back({first[i], second[j]});
            }
        }
        return true;
    }

    void test_candidates(const Frame& frame, ContactSet& contacts) {
        if (!settings_.limited()) {
            work_.triangle_tests += static_cast<std::int64_t>(candidates_.size());
            test_pairs(settings_.test, *topology_, frame, candidates_, contacts.pairs);
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
        if (static_cast<std::int64_t>(contacts.pairs.size()) >= settings_.max_pairs) {
            truncated_ = true;
            return false;
        }
        if (!spend(work_.triangle_tests, 1)) return false;
        test_pairs(settings_.test, *topology_, frame, {&pair, 1}, contacts.pairs);
        return true;
    }

    Settings settings_;
    const BoxKernels& kernels_ = box_kernels();
    const Topology* topology_ = nullptr;
    std::vector<bool> tested_;
    std::vector<MovingBody> bodies_;  ///< that take part, small to large
    std::int64_t vertices_in_use_ = 0;
    Lattice fine_;
    Lattice coarse_;
    Occupancy occupancy_;
    CellMap map_;
    bool ready_ = false;       ///< clusters are built
    bool known_ = false;       ///< chunk boxes are those of the last frame
    bool answerable_ = false;  ///< the last update's frame was
    bool truncated_ = false;
    bool truncated_in_update_ = false;
    WorkCounters work_;
    WorkCounters work_of_update_;

    // Buffers of one tick.
    std::vector<Item> items_;
    std::vector<Item> kept_;
    std::vector<Item> groups_;
    std::vector<Opened> opened_;
    std::vector<Index> large_;        ///< opened clusters that cover too many cells
    std::array<double, 3> origin_{};  ///< m; float boxes are relative to it
    bool cells_tell_ = true;          ///< the last level of occupancy was in reach of the lattice
    bool beyond_floats_ = false;      ///< so large that floats cannot hold it: every box overlaps every box
    std::vector<TrianglePair> candidates_;
    std::vector<TrianglePair> last_pairs_;  ///< under limits: sorted, what the tick before reported
};

}  // namespace

DetectorEntry ohc_clustered_detector() {
    using Type = Parameter::Type;
    return {
        .name = "ohc_clustered",
        .configuration = std::string("double precision boxes of chunks, float boxes of triangles rounded outward; "
                                     "exact triangle test; one thread; vectors: ") +
                         box_kernels().target,
        .own = true,
        .claims_exact = true,
        .parameters =
            {{.name = "order",
              .type = Type::choice,
              .default_value = "auto",
              .choices = {"auto", "given", "local"},
              .meaning = "vertices and triangles in the caller's order, in one made for locality, or the better one"},
             test_parameter(),
             max_pairs_parameter(),
             work_budget_parameter()},
        .make = [](const ParameterValues& values) {
            Settings settings;
            if (values.is("order", "given")) settings.order = ClusterOrder::given;
            if (values.is("order", "local")) settings.order = ClusterOrder::local;
            settings.test = triangle_test_from(values.text("test"));
            if (!values.is("max_pairs", "none")) settings.max_pairs = values.integer("max_pairs");
            if (!values.is("work_budget", "none")) settings.work_budget = values.integer("work_budget");
            return std::make_unique<OhcClustered>(settings);
        }};
}

}  // namespace trocar
