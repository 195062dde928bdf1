#include "detect/clustered_regions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

namespace trocar {
namespace {

/// A region that covers more cells is not hashed but paired with every other.
constexpr double most_cells = 512.0;

double longest_edge(const Extent& box) {
    return std::max({box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]});
}

}  // namespace

void ClusteredRegions::prepare(const Topology& topology) {
    filter_.prepare(topology);
    map_.prepare(filter_, CellHash::fibonacci, 10);
}

void ClusteredRegions::build() {
    regions_.clear();
    pairs_.clear();
    cells_are_set_ = false;
    for (std::size_t owner = 0; owner < bodies_.all().size(); ++owner) {
        for (Index r = 0; r < bodies_.all()[owner].clusters.region_count; ++r) {
            Region& region = regions_.emplace_back();
            region.owner = static_cast<Index>(owner);
            region.number = r;
        }
    }
    pairs_.reserve(2 * regions_.size());
    meetings_.reserve(2 * regions_.size());
    by_size_.reserve(2 * regions_.size());
    map_.reserve(ordinary_contact);
}

/// Cells have about the size of the median region and start there. A distant vertex enlarges one region and no cell.
void ClusteredRegions::choose_cells() {
    by_size_.clear();
    for (std::size_t k = 0; k < regions_.size(); ++k) {
        by_size_.push_back({longest_edge(extent_of(regions_[k])), static_cast<Index>(k)});
    }
    cells_are_set_ = true;
    if (by_size_.empty()) return;
    const Sized median = median_size();
    const Extent& box = extent_of(region(median.region));
    lattice_.set(median.size > 0.0 && std::isfinite(median.size) ? median.size : 1.0,
                 Vector3(box.low[0], box.low[1], box.low[2]));
}

/// Median of by_size_, which must not be empty.
ClusteredRegions::Sized ClusteredRegions::median_size() {
    const auto middle = by_size_.begin() + static_cast<std::ptrdiff_t>(by_size_.size() / 2);
    std::nth_element(by_size_.begin(), middle, by_size_.end());
    return *middle;
}

void ClusteredRegions::follow() {
    if (!cells_are_set_) choose_cells();
    if (std::exchange(entered_query_distance_, clock_.query_distance) != clock_.query_distance) {
        for (Region& region : regions_) enter(region, true);
        return;
    }
    for (const MovingBody& moving : bodies_.all()) {
        for (const Index r : moving.boxes->moved_regions()) {
            enter(regions_[moving.first_region + static_cast<std::size_t>(r)], false);
        }
    }
}

/// Assigns new cells to a region that left its cells, with half a cell of margin on all sides. Half of the query
/// distance is around each region, so two regions within it share a cell.
void ClusteredRegions::enter(Region& region, bool anew) {
    const Extent box = extent_of(region).grown(0.5 * clock_.query_distance);
    const Vector3 low(box.low[0], box.low[1], box.low[2]);
    const Vector3 high(box.high[0], box.high[1], box.high[2]);
    const CellRange now{lattice_.cell(low), lattice_.cell(high)};
    if (!anew && region.entered && region.range.contains(now)) return;
    const Vector3 room = Vector3::Constant(0.5 * lattice_.edge());
    region.range = {lattice_.cell(low - room), lattice_.cell(high + room)};
    region.entered = true;
    pairs_known_ = false;
}

void ClusteredRegions::find_pairs() {
    if (pairs_known_) return;
    pairs_.clear();
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
    if (!work_.spend(work_.counters.cells_visited, static_cast<std::int64_t>(cells))) return;
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
    map_.for_each_meeting(
        [this](const std::array<std::int32_t, 3>& cell, std::span<const Index> first, std::span<const Index> second) {
            for (const Index i : first) {
                const Cell p = region(i).range.low;
                for (const Index j : second) {
                    const Cell q = region(j).range.low;
                    // Counts the pair once, in the first cell that both regions cover.
                    if (cell[0] == std::max(p[0], q[0]) && cell[1] == std::max(p[1], q[1]) &&
                        cell[2] == std::max(p[2], q[2])) {
                        pairs_.push_back({i, j});
                    }
                }
            }
            return true;
        });
    for (const Index large : large_) {
        const Index body = owner_of(region(large)).body;
        for (std::size_t j = 0; j < regions_.size(); ++j) {
            // A pair of large regions is entered once, from the first of them.
            if (regions_[j].range.cell_count() > most_cells && j <= static_cast<std::size_t>(large)) continue;
            const Index other = owner_of(regions_[j]).body;
            if (!filter_.may_hit(body, other)) continue;
            const auto number = static_cast<Index>(j);
            pairs_.push_back(body < other ? Pair{large, number} : Pair{number, large});
        }
    }
    pairs_known_ = true;
}

void ClusteredRegions::find_meetings() {
    meetings_.clear();
    by_size_.clear();
    for (const Pair& pair : pairs_) {
        const Region& first = region(pair.first);
        const Region& second = region(pair.second);
        if (!clock_.moved(boxes_of(first).region_moved_at(first.number)) &&
            !clock_.moved(boxes_of(second).region_moved_at(second.number))) {
            continue;
        }
        if (!work_.spend(work_.counters.box_tests, 1)) return;
        if (!extent_of(first).grown(clock_.query_distance).overlaps(extent_of(second))) continue;
        meetings_.push_back(pair);
        by_size_.push_back(std::min(Sized{longest_edge(extent_of(first)), pair.first},
                                    Sized{longest_edge(extent_of(second)), pair.second}));
    }
}

}  // namespace trocar
