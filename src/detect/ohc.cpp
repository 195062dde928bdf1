// ohc: the detector that the thesis describes (§3.3, §4.2), as METHODS §2 reconstructs it. Space is split into equal
// cells, nothing is remembered from tick to tick, no mesh connectivity is used, and no body is ever held against
// another body: the work grows with the triangles, not with the pairs of bodies. A tick is a cascade, each level
// passing on only what it could not rule out:
//
//   lattice      every vertex -> its cell numbers; a triangle's cells are the range between its corners' cells
//   occupancy    one bit per cell: which cells hold triangles of two bodies (occupancy.hpp)            [update]
//   cell map     the triangles in such cells are hashed; a cell with two bodies that may collide is live
//   object map   the bodies in each live cell
//   primitive map  their triangles in each live cell (all three: cell_map.hpp)                         [detect]
//   boxes        triangles that share a live cell and whose boxes overlap; the pair counts in one cell only, the one
//                whose numbers are the larger of the two triangles' lowest numbers, so that no pair comes twice
//   triangles    the exact test (narrow_phase.hpp)
//
// Why no pair is missed: lattice.hpp. Triangles that span many cells are cut into pieces for marking and hashing only
// (they come repeatedly, which a sort undoes); those that would need more pieces than a plain look at every other
// triangle costs are looked at in that plain way.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "detect/cell_map.hpp"
#include "detect/lattice.hpp"
#include "detect/narrow_phase.hpp"
#include "detect/occupancy.hpp"
#include "detect/shared_parameters.hpp"
#include "detect/standing_map.hpp"
#include "detect/swept.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

constexpr double most_cells = 27.0;     ///< a triangle that covers more is cut into pieces (METHODS §2.4)
constexpr double most_pieces = 4096.0;  ///< a triangle that needs more is tested against everything

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

/// A triangle that reached the cell map.
struct Primitive {
    CellRange range;
    std::array<double, 3> low;   ///< box, m
    std::array<double, 3> high;  ///< m
    Index triangle;
    bool cut;  ///< in pieces: its cells are not a full range, so the one-cell rule does not hold for it
};

bool boxes_overlap(const Primitive& p, const Primitive& q) {
    // Without branches: which axis separates is unpredictable.
    unsigned overlap = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        overlap &= static_cast<unsigned>(p.low[k] <= q.high[k]) & static_cast<unsigned>(q.low[k] <= p.high[k]);
    }
    return overlap != 0;
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
        map_.prepare(std::move(collide), words, settings_.hash, settings_.hash_bits);
        numbers_.assign(3 * static_cast<std::size_t>(topology.vertex_count) + 1, 0);
        if (settings_.margin > 0.0 || settings_.swept) high_numbers_ = numbers_;
        if (settings_.swept) previous_numbers_ = numbers_;
        body_ranges_.resize(bodies);
        last_pairs_.clear();
        // Room for a crowded tick; more than this grows as it comes.
        const auto room = static_cast<std::size_t>(std::min<Index>(16384, topology.triangle_count()));
        for (std::vector<Index>* list : {&hot_, &huge_}) list->reserve(room);
        primitives_.reserve(room);
        for (std::vector<TrianglePair>* list : {&candidates_, &repeated_}) list->reserve(room);
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
        hot_.clear();
        huge_.clear();
        hot_cells_ = 0;
        answerable_ = is_answerable(*topology_, frame);
        way_ = settings_.swept && answerable_ && has_way(*topology_, frame);
        const std::int64_t to_read = topology_->vertex_count * std::int64_t{way_ ? 2 : 1};
        if (answerable_ && order_.size() > 1 && spend(work_.vertices_read, to_read)) {
            if (cell_edge_ == 0.0) choose_cell(frame);
            number_vertices(frame);
            mark_bodies(frame);
            collect_shared(frame);
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
            if (way_) {
                work_.triangle_tests += static_cast<std::int64_t>(candidates_.size());
                test_swept(*topology_, frame, candidates_, contacts.swept);
            }
        }
        std::sort(contacts.pairs.begin(), contacts.pairs.end());
        sort_swept(contacts.swept);
        contacts.work = work_;
        contacts.truncated = truncated_;
    }

private:
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
                lattice_.set(1.0, corner);  // all points coincide; asked again at the next tick
                return;
            }
        }
        cell_edge_ = edge;
        lattice_.set(edge, corner);
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

    void number_vertices(const Frame& frame) {
        if (number_all(frame)) return;
        // Something is further than 2^30 cells from the corner chosen before: choose one where the bodies are now.
        Vector3 corner = frame.position.rowwise().minCoeff();
        if (way_) corner = corner.cwiseMin(frame.previous.rowwise().minCoeff());
        lattice_.set(lattice_.edge(), corner);
        number_all(frame);
    }
    bool number_all(const Frame& frame) {
        const double* const points = frame.position.data();
        lattice_.numbers(points, topology_->vertex_count, -settings_.margin, numbers_.data());
        if (two_sided()) {
            lattice_.numbers(points, topology_->vertex_count, settings_.margin, high_numbers_.data());
        }
        if (way_) {
            const double* const before = frame.previous.data();
            const std::size_t count = 3 * static_cast<std::size_t>(topology_->vertex_count);
            lattice_.numbers(before, topology_->vertex_count, -settings_.margin, previous_numbers_.data());
            for (std::size_t i = 0; i < count; ++i) numbers_[i] = std::min(numbers_[i], previous_numbers_[i]);
            lattice_.numbers(before, topology_->vertex_count, settings_.margin, previous_numbers_.data());
            for (std::size_t i = 0; i < count; ++i) high_numbers_[i] = std::max(high_numbers_[i], previous_numbers_[i]);
        }
        constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
        scene_range_ = {Cell{most, most, most, 0}, Cell{-most, -most, -most, 0}};
        for (const Index body : order_) {
            CellRange range{Cell{most, most, most, 0}, Cell{-most, -most, -most, 0}};
            const Range vertices = topology_->bodies[static_cast<std::size_t>(body)].vertices;
            for (Index v = vertices.first; v < vertices.end(); ++v) {
                range.low = cell_min(range.low, load_cell(numbers_.data(), v));
                range.high = cell_max(range.high, load_cell(high_data(), v));
            }
            body_ranges_[static_cast<std::size_t>(body)] = range;
            scene_range_.low = cell_min(scene_range_.low, range.low);
            scene_range_.high = cell_max(scene_range_.high, range.high);
        }
        return !Lattice::at_limit(scene_range_);
    }
    /// A vertex covers more than one point: with a margin around it, or from frame to frame.
    [[nodiscard]] bool two_sided() const { return settings_.margin > 0.0 || way_; }
    [[nodiscard]] const std::int32_t* high_data() const { return two_sided() ? high_numbers_.data() : numbers_.data(); }
    [[nodiscard]] CellRange range_of(Index triangle) const {
        const Index* const v = topology_->triangles.data() + 3 * static_cast<std::size_t>(triangle);
        const std::int32_t* const low = numbers_.data();
        const std::int32_t* const high = high_data();
        return {cell_min(cell_min(load_cell(low, v[0]), load_cell(low, v[1])), load_cell(low, v[2])),
                cell_max(cell_max(load_cell(high, v[0]), load_cell(high, v[1])), load_cell(high, v[2]))};
    }

    // ---- large triangles ----

    /// How a large triangle is cut: `slabs` across its two long edges, each into `columns` along the third.
    struct Cut {
        int apex = 0;  ///< corner between the two long edges
        double slabs = 1.0;
        double columns = 1.0;
        double steps = 1.0;  ///< parts of the way from the frame before
        [[nodiscard]] double pieces() const { return slabs * columns * steps; }
    };
    [[nodiscard]] Cut cut_of(const Frame& frame, Index triangle) const {
        const auto v = topology_->triangles.col(triangle);
        std::array<double, 3> opposite{};  // largest extent of the edge opposite to each corner, in cells
        for (int k = 0; k < 3; ++k) {
            opposite[static_cast<std::size_t>(k)] =
                (frame.position.col(v((k + 2) % 3)) - frame.position.col(v((k + 1) % 3))).cwiseAbs().maxCoeff() /
                lattice_.edge();
        }
        Cut cut;
        cut.apex = static_cast<int>(std::min_element(opposite.begin(), opposite.end()) - opposite.begin());
        const double longest = *std::max_element(opposite.begin(), opposite.end());
        cut.slabs = std::max(1.0, std::ceil(longest / 2.0));
        cut.columns = std::max(1.0, std::ceil(opposite[static_cast<std::size_t>(cut.apex)] / 2.0));
        if (way_) {
            double way = 0.0;
            for (int k = 0; k < 3; ++k) {
                way = std::max(way, (frame.position.col(v(k)) - frame.previous.col(v(k))).cwiseAbs().maxCoeff());
            }
            cut.steps = std::max(1.0, std::ceil(way / lattice_.edge() / 2.0));
        }
        return cut;
    }
    /// Calls use(range) for cell ranges that together hold every point of the triangle.
    template <typename Use>
    void for_each_piece(const Frame& frame, Index triangle, const Cut& cut, const Use& use) const {
        const auto v = topology_->triangles.col(triangle);
        struct Pose {
            Vector3 apex;
            Vector3 left;
            Vector3 right;
            [[nodiscard]] Vector3 point(double s, double t) const {
                return (1.0 - s) * apex + s * ((1.0 - t) * left + t * right);
            }
            [[nodiscard]] double size() const {
                return apex.cwiseAbs().maxCoeff() + left.cwiseAbs().maxCoeff() + right.cwiseAbs().maxCoeff();
            }
        };
        const auto pose_in = [&](const Matrix3X& position) -> Pose {
            return {position.col(v(cut.apex)), position.col(v((cut.apex + 1) % 3)),
                    position.col(v((cut.apex + 2) % 3))};
        };
        const Pose here = pose_in(frame.position);
        const Pose before = way_ ? pose_in(frame.previous) : here;
        // The corners of a piece are rounded; a pad of some units in the last place keeps the pieces without gaps.
        const double pad =
            settings_.margin + 16.0 * std::numeric_limits<double>::epsilon() * std::max(here.size(), before.size());
        const Vector3 padding = Vector3::Constant(pad);
        const CellRange whole = range_of(triangle);
        // Counts are small here: a triangle with many pieces does not come this way.
        const int slabs = static_cast<int>(cut.slabs);
        const int steps = static_cast<int>(cut.steps);
        for (int i = 0; i < slabs; ++i) {
            // A slab nearer to the apex is narrower and needs fewer columns.
            const int columns = std::max(1, static_cast<int>(std::ceil(cut.columns * (i + 1) / slabs)));
            for (int j = 0; j < columns; ++j) {
                std::array<Vector3, 4> start;  // corners of the piece at the frame before, and the way to here
                std::array<Vector3, 4> way;
                for (std::size_t k = 0; k < 4; ++k) {
                    const double s = static_cast<double>(i + static_cast<int>(k / 2)) / slabs;
                    const double t = static_cast<double>(j + static_cast<int>(k % 2)) / columns;
                    start[k] = before.point(s, t);
                    way[k] = here.point(s, t) - start[k];
                }
                for (int step = 0; step < steps; ++step) {
                    Box box;
                    for (const int end : {step, step + 1}) {
                        const double part = static_cast<double>(end) / steps;
                        for (std::size_t k = 0; k < 4; ++k) box.add(start[k] + part * way[k]);
                    }
                    // No point of the triangle lies outside the cells between its corners'.
                    use(CellRange{cell_max(whole.low, lattice_.cell(box.min - padding)),
                                  cell_min(whole.high, lattice_.cell(box.max + padding))});
                }
            }
        }
    }

    /// Calls use(range) once for an ordinary triangle, once per piece for a large one, and not at all for one that is
    /// better tested against everything; that one is told to `too_large`.
    template <typename Use, typename TooLarge>
    void for_each_range(const Frame& frame, Index triangle, const Use& use, const TooLarge& too_large) const {
        const CellRange range = range_of(triangle);
        if (range.cell_count() <= most_cells) {
            use(range);
            return;
        }
        const Cut cut = cut_of(frame, triangle);
        if (cut.pieces() > std::min(most_pieces, 0.05 * topology_->triangle_count() + 16.0)) {
            too_large(triangle);
        } else {
            for_each_piece(frame, triangle, cut, use);
        }
    }

    // ---- occupancy ----

    void mark_bodies(const Frame& frame) {
        occupancy_.start(scene_range_);
        for (std::size_t k = 0; k + 1 < order_.size(); ++k) {
            const auto body = static_cast<std::size_t>(order_[k]);
            const Range triangles = topology_->bodies[body].triangles;
            for (Index t = triangles.first; t < triangles.end() && !truncated_; ++t) {
                for_each_range(
                    frame, t,
                    [this](const CellRange& range) {
                        if (afford(range)) work_.cells_visited += occupancy_.mark(range);
                    },
                    [this](Index triangle) { huge_.push_back(triangle); });
            }
            occupancy_.merge(body_ranges_[body]);
        }
    }
    /// Under a budget: whether one more range can be looked at.
    bool afford(const CellRange& range) {
        if (settings_.work_budget == std::numeric_limits<std::int64_t>::max()) return true;
        if (range.cell_count() <= static_cast<double>(settings_.work_budget - work_.work())) return !truncated_;
        truncated_ = true;
        return false;
    }

    /// The triangles that lie in a shared cell; the last body first, since its cells were not marked yet.
    void collect_shared(const Frame& frame) {
        occupancy_.spread_once();
        collect(frame, order_.back(), [this](const CellRange& range) {
            if (!occupancy_.any_once(range)) return false;
            occupancy_.share(range);
            return true;
        });
        if (hot_.empty() && order_.size() == 2) return;
        occupancy_.spread_shared();
        for (std::size_t k = 0; k + 1 < order_.size(); ++k) {
            collect(frame, order_[k], [this](const CellRange& range) { return occupancy_.any_shared(range); });
        }
    }
    template <typename IsShared>
    void collect(const Frame& frame, Index body, const IsShared& is_shared) {
        const Range triangles = topology_->bodies[static_cast<std::size_t>(body)].triangles;
        const bool last = body == order_.back();
        if (!spend(work_.cells_visited, triangles.count)) return;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            // Nearly all triangles end here: small, and nothing else near.
            const CellRange range = range_of(t);
            if (range.within(Occupancy::reach) && !occupancy_.near(range.low)) continue;
            bool shared = false;
            double cells = 0.0;
            for_each_range(
                frame, t,
                [&](const CellRange& part) {
                    if (!afford(part)) return;
                    ++work_.cells_visited;
                    cells += part.cell_count();
                    if (is_shared(part)) shared = true;
                },
                [&](Index triangle) {
                    if (last) huge_.push_back(triangle);
                });
            if (!shared) continue;
            hot_.push_back(t);
            hot_cells_ += static_cast<std::size_t>(cells);
        }
    }

    // ---- cell, object and primitive maps ----

    void hash_shared(const Frame& frame) {
        const auto ignore = [](Index) {};
        map_.start(hot_cells_);
        primitives_.clear();
        for (const Index t : hot_) {
            const auto number = static_cast<Index>(primitives_.size());
            const Index body = topology_->body_of_triangle[static_cast<std::size_t>(t)];
            const CellRange whole = range_of(t);
            Primitive primitive{
                .range = whole, .low = {}, .high = {}, .triangle = t, .cut = whole.cell_count() > most_cells};
            fill_box(frame, primitive);
            primitives_.push_back(primitive);
            for_each_range(
                frame, t,
                [&](const CellRange& range) {
                    for (std::int32_t z = range.low[2]; z <= range.high[2]; ++z) {
                        for (std::int32_t y = range.low[1]; y <= range.high[1]; ++y) {
                            for (std::int32_t x = range.low[0]; x <= range.high[0]; ++x) {
                                const Cell cell{x, y, z, 0};
                                if (!occupancy_.shared(cell)) continue;
                                if (!spend(work_.cells_visited, 1)) return;
                                map_.add(cell, body, number);
                            }
                        }
                    }
                },
                ignore);
        }
        map_.cascade();
    }
    void fill_box(const Frame& frame, Primitive& primitive) const {
        const Index* const v = topology_->triangles.data() + 3 * static_cast<std::size_t>(primitive.triangle);
        const auto fill = [&v, &primitive](const Matrix3X& position) {
            const double* const a = position.data() + 3 * static_cast<std::size_t>(v[0]);
            const double* const b = position.data() + 3 * static_cast<std::size_t>(v[1]);
            const double* const c = position.data() + 3 * static_cast<std::size_t>(v[2]);
            for (std::size_t k = 0; k < 3; ++k) {
                primitive.low[k] = std::min(primitive.low[k], std::min(std::min(a[k], b[k]), c[k]));
                primitive.high[k] = std::max(primitive.high[k], std::max(std::max(a[k], b[k]), c[k]));
            }
        };
        constexpr double infinity = std::numeric_limits<double>::infinity();
        primitive.low.fill(infinity);
        primitive.high.fill(-infinity);
        fill(frame.position);
        if (way_) fill(frame.previous);
        for (std::size_t k = 0; k < 3; ++k) {
            primitive.low[k] -= settings_.margin;
            primitive.high[k] += settings_.margin;
        }
    }

    /// Fills candidates_ (each pair once) and repeated_ (pairs of cut triangles). `after_meeting` is asked after the
    /// triangles of two bodies in one cell; false ends the search.
    template <typename AfterMeeting>
    void gather_candidates(const AfterMeeting& after_meeting) {
        map_.for_each_meeting(
            [&](const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second) {
                if (!spend(work_.box_tests, static_cast<std::int64_t>(first.size() * second.size()))) return false;
                for (const Index i : first) {
                    const Primitive& p = primitives_[static_cast<std::size_t>(i)];
                    for (const Index j : second) {
                        const Primitive& q = primitives_[static_cast<std::size_t>(j)];
                        if (!boxes_overlap(p, q)) continue;
                        if (p.cut || q.cut) {
                            repeated_.push_back({p.triangle, q.triangle});
                        } else if (cell[0] == std::max(p.range.low[0], q.range.low[0]) &&
                                   cell[1] == std::max(p.range.low[1], q.range.low[1]) &&
                                   cell[2] == std::max(p.range.low[2], q.range.low[2])) {
                            candidates_.push_back({p.triangle, q.triangle});
                        }
                    }
                }
                return after_meeting();
            });
    }

    /// Triangles too large for the lattice against every triangle of every body they may hit.
    void test_huge(const Frame& frame) {
        for (const Index t : huge_) {
            Primitive p{.range = range_of(t), .low = {}, .high = {}, .triangle = t, .cut = true};
            fill_box(frame, p);
            const Index own = topology_->body_of_triangle[static_cast<std::size_t>(t)];
            for (const Index body : order_) {
                if (!map_.may_hit(own, body)) continue;
                const Range triangles = topology_->bodies[static_cast<std::size_t>(body)].triangles;
                if (!spend(work_.box_tests, triangles.count)) return;
                for (Index other = triangles.first; other < triangles.end(); ++other) {
                    if (!p.range.overlaps(range_of(other))) continue;
                    Primitive q{.range = p.range, .low = {}, .high = {}, .triangle = other, .cut = true};
                    fill_box(frame, q);
                    if (boxes_overlap(p, q)) repeated_.push_back({std::min(t, other), std::max(t, other)});
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
            lattice_.numbers(here + i, 1, -settings_.margin, &numbers_[i]);
            if (two_sided()) lattice_.numbers(here + i, 1, settings_.margin, &high_numbers_[i]);
            if (Lattice::at_limit({load_cell(numbers_.data(), v), load_cell(high_data(), v)})) return false;
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
        number_vertices(frame);
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
            const CellRange range = range_of(t);
            const bool plain = range.cell_count() <= most_cells;
            if (plain && places_[at(t)] == Place::cells && range == ranges_[at(t)]) continue;
            if (places_[at(t)] == Place::huge) huge_.erase(std::find(huge_.begin(), huge_.end(), t));
            if (places_[at(t)] != Place::huge) work_.cells_visited += standing_.remove(t);
            ranges_[at(t)] = range;
            places_[at(t)] = plain ? Place::cells : Place::pieces;
            for_each_range(
                frame, t,
                [&](const CellRange& part) {
                    for (std::int32_t z = part.low[2]; z <= part.high[2]; ++z) {
                        for (std::int32_t y = part.low[1]; y <= part.high[1]; ++y) {
                            for (std::int32_t x = part.low[0]; x <= part.high[0]; ++x) {
                                ++work_.cells_visited;
                                standing_.insert(Cell{x, y, z, 0}, body_of(t), t);
                            }
                        }
                    }
                },
                [&](Index triangle) {
                    places_[at(triangle)] = Place::huge;
                    huge_.push_back(triangle);
                });
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
            Primitive p{
                .range = ranges_[at(t)], .low = {}, .high = {}, .triangle = t, .cut = places_[at(t)] == Place::pieces};
            fill_box(frame, p);
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
            Primitive p{.range = ranges_[at(t)], .low = {}, .high = {}, .triangle = t, .cut = true};
            fill_box(frame, p);
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
        Primitive q{.range = p.range, .low = {}, .high = {}, .triangle = other, .cut = p.cut};
        fill_box(frame, q);
        if (boxes_overlap(p, q)) list.push_back({std::min(p.triangle, other), std::max(p.triangle, other)});
    }
    static std::size_t at(Index number) { return static_cast<std::size_t>(number); }
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
                if (!way_ || !either_moved(*topology_, frame, pair)) continue;
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

    Settings settings_;
    const Topology* topology_ = nullptr;
    std::vector<Index> order_;  ///< bodies that take part
    Lattice lattice_;
    double cell_edge_ = 0.0;  ///< m; 0: not chosen yet
    CellMap map_;
    Occupancy occupancy_;
    bool answerable_ = false;
    bool way_ = false;  ///< boxes of this tick hold both of its ends
    bool truncated_ = false;
    WorkCounters work_;
    WorkCounters work_of_update_;
    bool truncated_in_update_ = false;

    // Buffers of one tick.
    std::vector<std::int32_t> numbers_;           ///< 3 per vertex: lowest cell of the vertex, less the margin
    std::vector<std::int32_t> high_numbers_;      ///< its highest cell, plus the margin; empty where both are one
    std::vector<std::int32_t> previous_numbers_;  ///< cells at the frame before; empty unless swept
    std::vector<CellRange> body_ranges_;
    CellRange scene_range_{};
    std::vector<Index> hot_;   ///< triangles in shared cells
    std::vector<Index> huge_;  ///< triangles tested against everything
    std::size_t hot_cells_ = 0;
    std::vector<Primitive> primitives_;
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
    Matrix3X last_;                             ///< 3×N, m: the positions that numbers_ and the maps stand for
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
