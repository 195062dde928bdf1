// The "common spatial tessellation method" of the thesis (Table 3.1, middle column): one level of equal cells, each
// with the list of all triangles in it, filled anew every tick; within a cell every two triangles of different bodies
// are held against each other. It stands here as what ohc claims to improve on, without ohc's ideas (no occupancy bits,
// no cascade, nothing ruled out before it is listed), but otherwise as a careful user would write it; candidates are
// decided by our exact test, so that against ohc only the broad phases differ.
//
// Settings, and why they are what a knowledgeable user would choose:
// * cell: 3 x the mean edge of the scene, chosen once from the first frame: the fastest of 0.5 to 4 in the benchmark's
//   sweep, where listing the triangles costs more than holding them against each other. (Teschner et al. 2003 advise
//   about one mean edge, for tetrahedra that are tested against points.)
// * storage=hashed (default): cells are hashed (Teschner et al. 2003, their three primes) into a table of at least as
//   many buckets as the scene has triangles, so that memory does not depend on the room that the scene takes. Cells
//   that share a bucket cost box tests, never a pair.
// * storage=dense: an array over all cells of the scene's box, at most 8 per triangle and never fewer than 64; the
//   cell edge grows until that holds. The textbook layout, and what the thesis calls inefficient.
// * lists are filled by counting, then writing, into one array, which keeps its memory from tick to tick.
// * a bucket with triangles of one body only is left at once.
// * within a query distance every box has half of it added on all sides, before it is put into cells and in every
//   box test.
// * a triangle over more cells than a quarter of the scene's triangles is tested against all others instead.
//
// No pair is missed: cell numbers are monotone in the coordinate, so overlapping boxes share a cell; the pair counts in
// the one cell whose numbers are the larger of the two lowest numbers, so none comes twice.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "candidates.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

using Int4 = std::int32_t __attribute__((vector_size(16)));  ///< cell numbers along x, y, z; the fourth is 0

Int4 lower(Int4 a, Int4 b) { return a < b ? a : b; }
Int4 higher(Int4 a, Int4 b) { return a > b ? a : b; }

/// Inclusive run of cells on each axis.
struct Cells {
    Int4 low;
    Int4 high;
    [[nodiscard]] double count() const {
        const Int4 more = high - low;
        return (more[0] + 1.0) * (more[1] + 1.0) * (more[2] + 1.0);
    }
    template <typename Use>
    void for_each(const Use& use) const {
        for (std::int32_t z = low[2]; z <= high[2]; ++z) {
            for (std::int32_t y = low[1]; y <= high[1]; ++y) {
                for (std::int32_t x = low[0]; x <= high[0]; ++x) use(Int4{x, y, z, 0});
            }
        }
    }
};

class SpatialTessellation final : public Detector {
public:
    SpatialTessellation(double cell, bool dense) : cell_(cell), dense_(dense) {}

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        edge_ = 0.0;
        cells_of_vertex_.assign(static_cast<std::size_t>(topology.vertex_count), Int4{});
        cells_after_vertex_.assign(static_cast<std::size_t>(topology.vertex_count), Int4{});
        if (is_answerable(topology, frame)) choose_edge(frame);
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        large_.clear();
        if (!is_answerable(*topology_, frame) || topology_->triangle_count() == 0) return;
        if (edge_ == 0.0) choose_edge(frame);
        double edge = edge_ > 0.0 ? edge_ : 1.0;
        find_box(frame);
        // Triangles far larger than the mean would fill the lists: such a scene gets larger cells for this tick.
        while (!number_cells(frame, edge) || !count_entries()) edge *= 2.0;
        fill();
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        contacts.query_distance = query_distance_;
        if (topology_->triangle_count() == 0) return;
        contacts.work.vertices_read = topology_->vertex_count;
        contacts.work.cells_visited = static_cast<std::int64_t>(entries_.size() + bucket_count_);
        candidates_.clear();
        for (std::size_t bucket = 0; bucket < bucket_count_; ++bucket) {
            const std::uint32_t first = starts_[bucket];
            const std::uint32_t end = starts_[bucket + 1];
            // Lists ascend, so a list whose ends are of one body holds nothing else.
            if (end - first < 2 || body_of(entries_[first]) == body_of(entries_[end - 1])) continue;
            test_bucket(frame, bucket, first, end, contacts);
        }
        test_large(frame, contacts);
        // A triangle can be twice in a bucket that several of its cells share.
        std::sort(candidates_.begin(), candidates_.end());
        candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());
        for (const TrianglePair& pair : candidates_) {
            baselines::test_candidate(*topology_, frame, pair.a, pair.b, contacts);
        }
    }

private:
    [[nodiscard]] Box box_of(const Frame& frame, Index triangle) const {
        return trocar::box_of(corners_of(topology_->triangles, frame.position, triangle)).grown(query_distance_ / 2.0);
    }
    [[nodiscard]] Index body_of(Index triangle) const {
        return topology_->body_of_triangle[static_cast<std::size_t>(triangle)];
    }

    void choose_edge(const Frame& frame) {
        double edge = cell_;
        if (std::isnan(edge)) {
            double sum = 0.0;
            for (Index t = 0; t < topology_->triangle_count(); ++t) {
                const Corners corner = corners_of(topology_->triangles, frame.position, t);
                for (std::size_t k = 0; k < 3; ++k) sum += (corner[(k + 1) % 3] - corner[k]).norm();
            }
            constexpr double mean_edges = 3.0;
            edge = mean_edges * sum / (3.0 * std::max(1.0, static_cast<double>(topology_->triangle_count())));
        }
        if (edge > 0.0 && std::isfinite(edge)) edge_ = edge;  // else all points coincide: asked again next tick
    }

    void find_box(const Frame& frame) {
        box_ = trocar::box_of(frame.position, {0, topology_->vertex_count}).grown(query_distance_ / 2.0);
    }

    /// Cell of every vertex, `edge` long (m); false when a dense array over them would be too large.
    bool number_cells(const Frame& frame, double edge) {
        constexpr double most = 1073741823.0;  // 2^30 - 1: what lies beyond shares the last cell
        const double inverse = std::min(1.0 / edge, 1e300);
        const auto number = [inverse](double offset) {
            const double t = offset * inverse;
            return static_cast<std::int32_t>(t < most ? t : most);  // offsets are not negative: this rounds down
        };
        Int4 last{};
        for (int axis = 0; axis < 3; ++axis) last[axis] = number(box_.max[axis] - box_.min[axis]);
        width_ = last + 1;
        if (dense_) {
            const double cells = (last[0] + 1.0) * (last[1] + 1.0) * (last[2] + 1.0);
            constexpr double cells_per_triangle = 8.0;
            if (cells > std::max(64.0, cells_per_triangle * topology_->triangle_count())) return false;
            bucket_count_ = static_cast<std::size_t>(cells);
        } else {
            bucket_count_ = 64;
            while (bucket_count_ < static_cast<std::size_t>(topology_->triangle_count())) bucket_count_ *= 2;
        }
        const auto number_all = [&](double shift, std::vector<Int4>& cells) {
            const double* p = frame.position.data();
            for (Int4& cell : cells) {
                cell = Int4{number((p[0] + shift) - box_.min[0]), number((p[1] + shift) - box_.min[1]),
                            number((p[2] + shift) - box_.min[2]), 0};
                p += 3;
            }
        };
        number_all(-query_distance_ / 2.0, cells_of_vertex_);
        if (query_distance_ > 0.0) number_all(query_distance_ / 2.0, cells_after_vertex_);
        return true;
    }

    [[nodiscard]] Cells cells_of(Index triangle) const {
        const Index* const corner = topology_->triangles.data() + 3 * static_cast<std::ptrdiff_t>(triangle);
        const auto of = [corner](const std::vector<Int4>& cells, int k) {
            return cells[static_cast<std::size_t>(corner[k])];
        };
        const std::vector<Int4>& after = query_distance_ > 0.0 ? cells_after_vertex_ : cells_of_vertex_;
        return {lower(lower(of(cells_of_vertex_, 0), of(cells_of_vertex_, 1)), of(cells_of_vertex_, 2)),
                higher(higher(of(after, 0), of(after, 1)), of(after, 2))};
    }
    [[nodiscard]] std::size_t bucket_of(Int4 cell) const {
        const auto x = static_cast<std::size_t>(cell[0]);
        const auto y = static_cast<std::size_t>(cell[1]);
        const auto z = static_cast<std::size_t>(cell[2]);
        if (dense_) return x + static_cast<std::size_t>(width_[0]) * (y + static_cast<std::size_t>(width_[1]) * z);
        return ((73856093 * x) ^ (19349663 * y) ^ (83492791 * z)) & (bucket_count_ - 1);
    }

    /// Counts into starts_[bucket + 1]; false when the lists would hold more than a fixed multiple of the triangles.
    bool count_entries() {
        starts_.assign(bucket_count_ + 1, 0);
        large_.clear();
        runs_.clear();
        buckets_.clear();
        const Index triangles = topology_->triangle_count();
        const double most_cells = 0.25 * triangles + 64.0;
        const double most_entries = 64.0 * triangles + 65536.0;
        double entries = 0.0;
        for (Index t = 0; t < triangles; ++t) {
            const Cells cells = cells_of(t);
            const double count = cells.count();
            if (count > most_cells) {
                large_.push_back(t);
                continue;
            }
            entries += count;
            if (entries > most_entries) return false;
            // Where a triangle goes is kept for fill(): loops of such varying length are what costs time here.
            runs_.push_back({t, static_cast<std::uint32_t>(count)});
            cells.for_each([this](Int4 cell) {
                const auto bucket = static_cast<std::uint32_t>(bucket_of(cell));
                buckets_.push_back(bucket);
                ++starts_[bucket + 1];
            });
        }
        for (std::size_t bucket = 0; bucket < bucket_count_; ++bucket) starts_[bucket + 1] += starts_[bucket];
        entries_.resize(starts_.back());
        return true;
    }

    void fill() {
        next_.assign(starts_.begin(), starts_.end() - 1);
        const std::uint32_t* bucket = buckets_.data();
        for (const Run& run : runs_) {
            for (std::uint32_t i = 0; i < run.count; ++i) entries_[next_[*bucket++]++] = run.triangle;
        }
    }

    /// Every two triangles of different bodies in one list.
    void test_bucket(const Frame& frame, std::size_t bucket, std::uint32_t first, std::uint32_t end,
                     ContactSet& contacts) {
        boxes_.clear();
        for (std::uint32_t i = first; i < end; ++i) {
            boxes_.push_back(box_of(frame, entries_[i]));
        }
        std::uint32_t other_body = first;  // where the next body's triangles begin
        for (std::uint32_t i = first; i < end; ++i) {
            const Index a = entries_[i];
            while (other_body < end && body_of(entries_[other_body]) == body_of(a)) ++other_body;
            Index body = -1;
            bool tested = false;
            for (std::uint32_t j = other_body; j < end; ++j) {
                const Index b = entries_[j];
                if (body_of(b) != body) {
                    body = body_of(b);
                    tested = topology_->body_pair(body_of(a), body) >= 0;
                }
                if (!tested) continue;
                ++contacts.work.box_tests;
                if (!boxes_[i - first].overlaps(boxes_[j - first])) continue;
                if (bucket_of(higher(cells_of(a).low, cells_of(b).low)) == bucket) candidates_.push_back({a, b});
            }
        }
    }

    void test_large(const Frame& frame, ContactSet& contacts) {
        for (const Index t : large_) {
            const Box box = box_of(frame, t);
            for (Index body = 0; body < topology_->body_count(); ++body) {
                const Index own = body_of(t);
                if (topology_->body_pair(std::min(own, body), std::max(own, body)) < 0) continue;
                const Range triangles = topology_->bodies[static_cast<std::size_t>(body)].triangles;
                contacts.work.box_tests += triangles.count;
                for (Index other = triangles.first; other < triangles.end(); ++other) {
                    if (!box.overlaps(box_of(frame, other))) continue;
                    candidates_.push_back({std::min(t, other), std::max(t, other)});
                }
            }
        }
    }

    double cell_;  ///< m, as set; NaN: chosen from the first frame
    bool dense_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    double edge_ = 0.0;            ///< m; 0: not chosen yet
    Box box_;
    Int4 width_{};  ///< cells along each axis
    std::size_t bucket_count_ = 0;
    std::vector<Int4> cells_of_vertex_;  ///< of the point half the query distance before it
    std::vector<Int4>
        cells_after_vertex_;  ///< of the point half the query distance after it; unused at query distance 0
    struct Run {
        Index triangle;
        std::uint32_t count;
    };
    std::vector<Run> runs_;               ///< triangles that are listed, ascending, and over how many cells
    std::vector<std::uint32_t> buckets_;  ///< of one triangle's cells after the other's
    std::vector<std::uint32_t> starts_;   ///< per bucket: where its list starts in entries_
    std::vector<std::uint32_t> next_;
    std::vector<Index> entries_;  ///< triangle numbers, ascending within a bucket
    std::vector<Index> large_;    ///< triangles over too many cells, ascending
    std::vector<Box> boxes_;      ///< of one bucket
    std::vector<TrianglePair> candidates_;
};

}  // namespace

DetectorEntry spatial_tessellation_detector();
DetectorEntry spatial_tessellation_detector() {
    return {
        .name = "spatial_tessellation",
        .configuration = "one level of equal cells, rebuilt every tick; candidates decided by trocar's exact test",
        .claims_exact = true,
        .query_distance = true,
        .parameters = {{.name = "cell",
                        .unit = "m",
                        .default_value = "auto",
                        .minimum = 1e-12,
                        .meaning = "edge of a cell; auto = 3 x the mean edge of the first frame",
                        .words = {"auto"}},
                       choice_parameter("storage", "hashed", {"hashed", "dense"},
                                        "cells hashed into as many buckets as triangles, or an array over all cells")},
        .make = [](const ParameterValues& values) {
            return std::make_unique<SpatialTessellation>(values.number("cell"), values.is("storage", "dense"));
        }};
}

}  // namespace trocar
